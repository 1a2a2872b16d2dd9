"""The camera: pinhole with a lens, sensor noise (EMVA 1288), data sheets, calibrations, tone curves."""
