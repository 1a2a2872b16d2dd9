// Numbers, bars and tables beside the sphere.

const $ = (id) => document.getElementById(id);

export function number(value, digits = 3) {
  if (value === null || value === undefined) return "-";
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-6 || size >= 1e6) ? value.toExponential(digits - 1) : Number(value.toPrecision(digits)).toString();
}

// A part of one in per cent, two digits; from ten on how many times, as on the page of a station.
export function percent(value) {
  if (value === null || value === undefined) return "-";
  return Math.abs(value) < 10 ? `${Number((100 * value).toPrecision(2))} %` : `${Number(value.toPrecision(2))} x`;
}

// A requirement's name as on the page of a station: a position's x and y without a point.
export const named = (name) => name.replace(/\.([xy])$/, ", $1");

const united = (text, unit) => (text === "-" ? text : unit === "degrees" ? `${text}°` : `${text} ${unit}`);

export function element(name, text = "", kind = "") {
  const made = document.createElement(name);
  made.textContent = text;
  made.className = kind;
  return made;
}

const mood = (status) => (["ok", "clutter", "glanced"].includes(status) ? status : "bad");
const fine = (status) => status === "ok" || status === "glanced";
const shown = (status, doubt = "") => (status === "glanced" ? "being computed" : doubt ? `${doubt}: ${status}` : status); // a close look follows and says

function row(cells, kind = "") {
  const made = element("tr", "", kind);
  cells.forEach((cell) => {
    const place = element("td");
    place.append(cell);
    made.append(place);
  });
  return made;
}

export function answer(message, state, choose) {
  const status = $("status");
  if (message.refused) {
    $("sigma").textContent = "-";
    status.textContent = "refused";
    status.className = "bad";
    $("why").textContent = message.refused;
    $("remedy").hidden = true;
    $("connection").textContent = "refused";
    $("shares").replaceChildren();
    return;
  }
  const chosen = message.measurands[state.measurand], rough = message.closely ? "" : "about ";
  $("sigma").textContent = chosen.sigma === null ? "cannot be measured" : `${rough}sigma ${united(number(chosen.sigma), chosen.unit)}`;
  $("sigma").dataset.sigma = chosen.sigma ?? "";
  $("sigma").dataset.closely = message.closely;
  status.textContent = shown(chosen.status, chosen.doubt);
  status.className = mood(chosen.status);
  const blamed = message.edges.filter((edge) => edge.status === chosen.status).map((edge) => edge.name).join(", ");
  const glance = message.closely || chosen.status === "glanced" ? "" : " Bias and close look follow when nothing moves.";
  const about = chosen.reason || `${chosen.why}${!fine(chosen.status) && blamed ? ` (${blamed})` : ""}`;
  $("why").textContent = `${about[0].toUpperCase()}${about.slice(1)}.${glance}${message.closely || !state.views.length ? together(chosen) : " What all views tell together follows, too."}`;
  $("remedy").hidden = !chosen.remedy;
  $("remedy").lastElementChild.textContent = chosen.remedy.replaceAll("`", "");
  $("connection").textContent = `${$("sigma").textContent}, ${status.textContent}`;
  shares(message);
  $("measurands").tBodies[0].replaceChildren(...message.measurands.map((each, i) => {
    const off = each.tolerance && each.bias !== null ? Math.abs(each.bias) / each.tolerance : null;
    const sigma = united(each.together ? `${number(each.sigma)} (${number(each.together.sigma)})` : number(each.sigma), each.unit);
    const made = row([named(each.name), sigma, part(each.ratio), off === null ? (message.closely ? united(number(each.bias, 2), each.unit) : "...") : part(off),
      element("span", shown(each.status, each.doubt), `status ${mood(each.status)}`)], i === state.measurand ? "chosen pick" : "pick");
    made.title = `bias ${message.closely ? united(number(each.bias, 2), each.unit) : "being computed"}. ` + (each.remedy ? `${each.why}: ${each.remedy}` : each.why);
    made.onclick = () => choose(i);
    return made;
  }));
  $("edges").tBodies[0].replaceChildren(...message.edges.map((edge) => row([edge.name, number(edge.length), number(edge.contrast),
    element("span", shown(edge.status), `status ${mood(edge.status)}`)])));
  const bad = message.edges.filter((edge) => !fine(edge.status));
  $("worst-edge").textContent = bad.length ? `${bad.length} of ${message.edges.length} not ok` : message.closely ? "all ok" : shown("glanced");
}

// What the kept views add.
function together(each) {
  if (!each.together) return "";
  const { sigma, status, views } = each.together;
  return sigma === null ? " Not even all views together measure it." : ` With all views: sigma ${united(number(sigma), each.unit)} from ${views}, ${status}.`;
}

// A bar of what is 1 at the limit, and its number.
function part(value) {
  const made = element("span");
  if (value !== null) {
    const bar = element("span", "", "part"), fill = element("b", "", value > 1 ? "over" : "");
    fill.style.width = `${100 * Math.min(value, 1)}%`;
    bar.append(fill);
    made.append(bar);
  }
  made.append(percent(value));
  return made;
}

export function budget(rows) {
  $("budget").replaceChildren(...rows.map((each) => {
    const made = element("div", "", "source"), head = element("p"), bar = element("span", "", "part wide");
    const told = each.U === null ? "cannot be measured" : each.ratio === null ? `U ${united(number(each.U, 2), each.unit)}, no tolerance given`
      : `U ${united(number(each.U, 2), each.unit)}, ${percent(each.ratio)} of half the tolerance zone`;
    head.append(element("span", named(each.name)), element("span", told));
    const long = each.ratio === null ? 1 : Math.min(each.ratio, 1);
    each.parts.forEach(([name, share]) => {
      const fill = element("b");
      fill.style.width = `${100 * long * share}%`;
      fill.title = name;
      bar.append(fill);
    });
    made.append(head, bar, element("small", each.parts.map(([name, share]) => `${name} ${(100 * share).toFixed(0)} %`).join(", ")));
    return made;
  }));
  $("budget-small").textContent = "U (95 %), and the shares of its square by source";
}

function shares(message) {
  const rows = Object.entries(message.shares || {}).map(([name, part], i) => {
    const made = element("div", "", i ? "bar" : "bar limits"), bar = element("span"), fill = element("b");
    fill.style.width = `${100 * part}%`;
    bar.append(fill);
    made.append(element("div", name), bar, element("output", `${(100 * part).toFixed(1)} %`));
    return made;
  });
  if (!rows.length) rows.push(element("p", "nothing: it cannot be measured"));
  $("shares").replaceChildren(...rows);
}

export function effects(rows) {
  $("effects").replaceChildren(...rows.map((each) => element("li", `${each.name}${each.on ? "" : " (left out)"}: ${each.reason}`, each.on ? "" : "off")));
  $("effect-count").textContent = `${rows.filter((each) => each.on).length} of ${rows.length}`;
}

export function proof(rows, state, where) {
  const each = rows[state.measurand];
  const table = element("table"), head = element("thead");
  head.append(row(["", "sigma: predicted", "from the rendered picture", "measured", "measured / predicted variance [95 %]", "no value"]));
  const body = element("tbody");
  rows.forEach((r, i) => body.append(row([named(r.name), number(r.calibrated), number(r.propagated), number(r.measured),
    r.ratio === null ? "-" : `${r.ratio.toFixed(3)} [${r.interval.map((end) => end.toFixed(3)).join(", ")}]`, `${r.failed} of ${r.n}`], i === state.measurand ? "chosen" : "")));
  table.append(head, body);
  const said = each.ratio === null ? `It could not be measured (${each.status}).`
    : `${named(each.name)}: ${each.doubt ? `not proven (${each.doubt}); ` : ""}1 lies ${each.agrees ? "inside" : "outside"} the 95 % interval of measured over predicted variance${each.agrees ? "" : ", as it does by chance one time in 20"}; bias ${united(number(each.bias, 2), each.unit)}, predicted ${united(number(each.predicted_bias, 2), each.unit)}.`;
  const canvas = element("canvas", "", "hist");
  const title = element("h2", "Simulated pictures, measured, beside the prediction ");
  title.append(element("small", `at ${where}`));
  $("proof").replaceChildren(title, element("p", said), canvas, table);
  $("proof").dataset.ratio = each.ratio ?? "";
  if (each.counts.length) histogram(canvas, each);
}

function histogram(canvas, each) {
  const ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight, base = high - 16;
  canvas.width = wide * ratio;
  canvas.height = high * ratio;
  const pen = canvas.getContext("2d"), { counts, edges, mean, propagated: sigma } = each;
  pen.scale(ratio, ratio);
  const low = Math.min(edges[0], mean - 3.5 * sigma), span = Math.max(edges.at(-1), mean + 3.5 * sigma) - low;
  const x = (value) => (value - low) / span * wide, step = edges[1] - edges[0];
  const bell = (value) => (each.n - each.failed) * step / sigma / 2.50663 * Math.exp(-(((value - mean) / sigma) ** 2) / 2);
  const most = Math.max(...counts, bell(mean)) * 1.05;
  pen.fillStyle = "#b9cfe6";
  counts.forEach((n, i) => pen.fillRect(x(edges[i]), base - n / most * base, x(edges[i + 1]) - x(edges[i]) - 0.5, n / most * base));
  pen.strokeStyle = "#d1342b";
  pen.lineWidth = 2;
  pen.beginPath();
  for (let i = 0; i <= 100; i += 1) pen.lineTo(i / 100 * wide, base - bell(low + i / 100 * span) / most * base);
  pen.stroke();
  pen.fillStyle = "#5b6575";
  pen.font = "11px system-ui";
  pen.fillText(`${number(low, 6)}`, 0, high - 3);
  const text = `${number(low + span, 6)} ${each.unit}`;
  pen.fillText(text, wide - pen.measureText(text).width, high - 3);
  pen.fillText("bars: measured; line: predicted from the rendered picture", 4, 11);
}
