// The visitor's state, what is sent of it, and what is done with what comes back.

import { View, colour, range } from "./view.js";
import { Picture } from "./picture.js";
import { Solid } from "./solid.js";
import * as panel from "./panel.js";
import { History } from "./history.js";
import * as address from "./address.js";

const $ = (id) => document.getElementById(id);
const REST_MS = 250; // without a movement before the long work begins
let scene = null, state = null, latest = null, number = 0, frame = 0, timer = 0, socket = null;
let wanted = address.read(location.hash); // what the address asks for, until it is sent
const past = new History(() => { $("undo").disabled = !past.before; $("redo").disabled = !past.after; });
const view = new View($("sphere"), moved, choose), picture = new Picture($("picture"), $("caption"));
window.explore = { view, picture, get state() { return state; }, get number() { return number; }, answered: 0 };

connect();

function connect() {
  socket = new WebSocket(`ws://${location.host}/socket`);
  socket.onopen = () => { $("connection").textContent = ""; };
  socket.onmessage = (event) => { const message = JSON.parse(event.data); take[message.type](message); };
  socket.onclose = () => {
    $("connection").textContent = "not connected; trying again ...";
    setTimeout(connect, 2000);
  };
}

function send(message) {
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

// The newest state, once a frame; when nothing has moved for a while, that it rests.
function ask(rest) {
  view.draw();
  poses();
  if (rest) views();
  clearTimeout(timer);
  if (rest) {
    cancelAnimationFrame(frame);
    frame = 0;
    push(true);
    return;
  }
  if (!frame) frame = requestAnimationFrame(() => { frame = 0; push(false); });
  timer = setTimeout(() => push(true), REST_MS);
}

function push(rest) {
  number += 1;
  if (rest && !wanted) {
    past.keep(state);
    address.write(state);
  }
  send({ type: "state", state, rest, number });
}

function moved(which, to, rest) {
  if (to) {
    const rounded = [Math.round(to[0] * 10) / 10, Math.round(to[1] * 10) / 10 % 360];
    if (which < 0) state.sensor = rounded;
    else state.lights[which] = rounded;
  }
  ask(rest);
}

// Another state as a whole; what the page shows of it follows.
function adopt(next) {
  if (!next) return;
  state = next;
  view.state = state;
  measurand(state.measurand);
}

function keep() {
  if (state.views.length >= scene.views) {
    $("said").textContent = `views must be at most ${scene.views} beside this one.`;
    return;
  }
  state.views = [...state.views, { sensor: [...state.sensor], lights: state.lights.map((pose) => [...pose]) }];
  ask(true);
}

function views() {
  $("views").hidden = !state.views.length;
  $("views").lastElementChild.replaceChildren(...state.views.map((each, i) => {
    const made = panel.element("li", `camera (${each.sensor})${each.lights.map((pose) => `, lamp (${pose})`).join("")}`);
    const go = panel.element("button", "Go there"), drop = panel.element("button", "Leave out");
    const others = state.views.filter((_, k) => k !== i);
    go.onclick = () => adopt({ ...state, sensor: [...each.sensor], lights: each.lights.map((pose) => [...pose]), views: others });
    drop.onclick = () => adopt({ ...state, views: others });
    made.append(go, drop);
    return made;
  }));
}

function choose(which) {
  if (which === state.moving) return;
  state.moving = which;
  ask(false);
}

function measurand(index) {
  state.measurand = index;
  if (state.shown === "ratio" && !scene.measurands[index].tolerance) state.shown = "sigma";
  $("measurand").value = index;
  $("shown").value = state.shown;
  $("shown").options[1].disabled = !scene.measurands[index].tolerance;
  $("shown").options[2].disabled = !scene.measurands.some((each) => each.tolerance);
  ask(true);
}

const take = {
  scene(message) {
    scene = { ...message, solid: new Solid(message) };
    if (state === null) state = message.state;
    Object.assign(view, { scene, state });
    if (state.sensor[0] > 90) view.tilt = -Math.abs(view.tilt); // seen from where the camera is
    $("title").textContent = `${scene.name}: ${scene.title}`;
    $("measurand").replaceChildren(...scene.measurands.map((each, i) => new Option(`${panel.named(each.name)} (${each.kind})`, i)));
    $("prove").firstChild.textContent = `Prove it by ${scene.renders} simulations `;
    inputs();
    measurand(state.measurand);
    if (wanted) {
      const asked = wanted;
      wanted = null;
      if (asked.refused) $("said").textContent = asked.refused;
      else send({ type: "restore", state: asked });
    }
  },
  answer(message) {
    if (message.number < window.explore.answered) return;
    window.explore.answered = message.number;
    window.explore.core_s = message.core_s;
    latest = message;
    view.limiting = message.limiting;
    panel.answer(message, state, measurand);
    if (message.picture) picture.show(message.picture, message.overlay, message.limiting);
    view.draw();
  },
  picture(message) { picture.show(message.picture); },
  colouring({ done, total }) {
    $("colouring").hidden = done >= total;
    Object.assign($("coloured"), { max: total, value: done });
  },
  sphere(message) {
    view.map = message;
    view.draw();
    legend(message);
  },
  budget(message) { panel.budget(message.rows); },
  effects(message) { panel.effects(message.rows); },
  moved(message) {
    adopt(message.state);
    $("said").textContent = message.text;
  },
  job(message) {
    const busy = message.state === "begun", words = { best: "searching", prove: "rendering", render: "rendering" };
    $("work").hidden = !busy;
    $("working").textContent = words[message.kind];
    $("progress").removeAttribute("value");
    for (const id of ["best", "prove", "render"]) $(id).disabled = busy;
    if (busy) $("said").textContent = "";
  },
  progress(message) {
    if (!message.done) return;
    $("progress").max = message.total;
    $("progress").value = message.done;
    $("working").textContent = `${message.done} of ${message.total} pictures measured`;
  },
  proof(message) {
    const lamps = message.state.lights.map((pose) => `(${pose})`).join(" ");
    panel.proof(message.rows, message.state, `camera (${message.state.sensor})${lamps && `, lamp ${lamps}`}`);
  },
  saved(message) { $("said").textContent = `Saved: ${message.path}`; },
  exists(message) {
    const button = panel.element("button", "Replace it");
    button.onclick = () => send({ type: "save", replace: true });
    $("said").replaceChildren(`${message.text}. `, button);
  },
  told(message) { $("said").textContent = message.text; },
};

function inputs() {
  const things = [["camera", -1], ...state.lights.map((_, i) => [state.lights.length > 1 ? `lamp ${i + 1}` : "lamp", i])];
  $("poses").replaceChildren(...things.map(([name, which]) => {
    const label = document.createElement("label"), radio = document.createElement("input");
    Object.assign(radio, { type: "radio", name: "moving", value: which });
    radio.onchange = () => choose(which);
    const boxes = [0, 1].map((k) => {
      const box = document.createElement("input");
      Object.assign(box, { type: "number", step: 1, min: k ? -360 : 0, max: k ? 720 : 180, id: `pose${which}-${k}` });
      box.setAttribute("aria-label", `${name}, ${k ? "azimuth" : "angle from the vertical"}, degrees`);
      box.onchange = () => {
        if (box.value === "" || !box.checkValidity()) return;
        const to = [...(which < 0 ? state.sensor : state.lights[which])];
        to[k] = Number(box.value);
        moved(which, to, true);
      };
      return box;
    });
    label.append(radio, name, ...boxes);
    return label;
  }));
}

function poses() {
  [state.sensor, ...state.lights].forEach((pose, i) => pose.forEach((angle, k) => {
    const box = $(`pose${i - 1}-${k}`);
    if (box && box !== document.activeElement) box.value = angle;
  }));
  document.querySelectorAll("#poses input[type=radio]").forEach((box) => { box.checked = Number(box.value) === state.moving; });
}

function legend(map) {
  const limits = range(map.values), bar = $("legend-bar"), who = map.moving < 0 ? "camera" : state.lights.length > 1 ? `lamp ${map.moving + 1}` : "lamp";
  const name = map.shown === "worst" ? "of the worst requirement" : `of ${panel.named(scene.measurands[state.measurand].name)}`;
  const unit = map.unit === "degrees" ? ", degrees" : map.unit && `, ${map.unit}`, share = map.shown !== "sigma";
  $("legend-title").textContent = `Colour of a place: ${map.what}, ${name}${unit}, with the ${who} there and all else as it is${map.about ? "; holes are looked at roughly, so rather too large" : ""}`;
  $("legend-numbers").replaceChildren();
  const pen = bar.getContext("2d");
  pen.clearRect(0, 0, bar.width, bar.height);
  if (!limits) {
    $("legend-title").textContent += ": it can be measured from nowhere";
    return;
  }
  for (let x = 0; x < bar.width; x += 1) { pen.fillStyle = colour(1 - x / bar.width); pen.fillRect(x, 0, 1, bar.height); }
  const beyond = map.values.some((value) => value !== null && value > limits.high);
  [0, 0.5, 1].forEach((part) => $("legend-numbers").append(panel.element("span",
    `${(share ? panel.percent : panel.number)(limits.low * (limits.high / limits.low) ** part)}${part === 1 && beyond ? " and more" : part ? "" : " (best)"}`)));
}

// the keys are the page's again once something is chosen
$("measurand").onchange = () => { $("measurand").blur(); measurand(Number($("measurand").value)); };
$("shown").onchange = () => { $("shown").blur(); state.shown = $("shown").value; ask(true); };
for (const kind of ["best", "prove", "render", "save"]) $(kind).onclick = () => send({ type: kind });
$("undo").onclick = () => adopt(past.undo());
$("redo").onclick = () => adopt(past.redo());
$("keep").onclick = keep;
window.addEventListener("hashchange", () => {
  const asked = address.read(location.hash);
  if (asked && asked.refused) $("said").textContent = asked.refused;
  else if (asked) send({ type: "restore", state: asked });
});
$("cancel").onclick = () => send({ type: "cancel" });
window.addEventListener("resize", () => { view.draw(); picture.draw(); if (view.map) legend(view.map); });

const ARROWS = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
const KEYS = {
  b: () => $("best").click(), p: () => $("prove").click(), r: () => $("render").click(), s: () => $("save").click(),
  Escape: () => $("cancel").click(), c: () => choose(-1), l: () => { if (state.lights.length) choose((state.moving + 1) % state.lights.length); },
  u: () => $("undo").click(), y: () => $("redo").click(), v: keep,
  m: () => measurand((state.measurand + 1) % scene.measurands.length),
  "[": () => { view.turn -= 10; view.draw(); }, "]": () => { view.turn += 10; view.draw(); },
};

document.addEventListener("keydown", (event) => {
  const typing = event.target instanceof HTMLSelectElement || (event.target instanceof HTMLInputElement && event.target.type === "number");
  const back = (event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z";
  if (state && back && !typing) {
    adopt(event.shiftKey ? past.redo() : past.undo());
    event.preventDefault();
    return;
  }
  if (!state || event.ctrlKey || event.metaKey || event.altKey || (typing && event.key !== "Escape")) return;
  if (event.key in ARROWS) {
    const by = event.shiftKey ? 5 : 1, [polar, azimuth] = ARROWS[event.key];
    const at = state.moving < 0 ? state.sensor : state.lights[state.moving];
    moved(state.moving, [Math.min(Math.max(at[0] + by * polar, 0), 180), (at[1] + by * azimuth + 360) % 360], false);
    event.preventDefault();
  } else if (event.key in KEYS) KEYS[event.key]();
});
