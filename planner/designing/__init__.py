"""Which camera, lens and light to buy: search and bounds over a catalogue."""
