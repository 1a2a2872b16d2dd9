// A state as the part of an address behind #, and back. What comes back is checked where all messages are.

const MOST = 2000; // characters
const pair = (pose) => pose.join(",");
const poses = (text) => text.split(";").map((each) => each.split(",").map((angle) => (angle.trim() === "" ? NaN : Number(angle))));

export function write(state) {
  const parts = [`camera=${pair(state.sensor)}`, ...state.lights.map((pose) => `lamp=${pair(pose)}`),
    `measurand=${state.measurand}`, `shown=${state.shown}`, `moving=${state.moving}`,
    ...state.views.map(({ sensor, lights }) => `view=${[sensor, ...lights].map(pair).join(";")}`)];
  history.replaceState(null, "", `#${parts.join("&")}`);
}

// null where the address says nothing.
export function read(hash) {
  if (hash.length < 2) return null;
  if (hash.length > MOST) return { refused: `address must have at most ${MOST} characters behind #, got ${hash.length}` };
  const told = new URLSearchParams(hash.slice(1)), single = (name) => poses(told.get(name) || "")[0];
  return {
    sensor: single("camera"),
    lights: told.getAll("lamp").map((text) => poses(text)[0]),
    measurand: Number(told.get("measurand") || 0),
    shown: told.get("shown") || "sigma",
    moving: Number(told.get("moving") ?? -1),
    views: told.getAll("view").map(poses).map(([sensor, ...lights]) => ({ sensor, lights })),
  };
}
