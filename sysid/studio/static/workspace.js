// One joint from all sides: torque over time, the residual against position and speed, the robot. One cursor and one brush
// go through all of them. Every text goes into the page as text, never as markup.
(() => {
"use strict";
const PANELS = ["position", "speed", "map", "robot"];
const at = id => document.getElementById(id);
let tools = null; // what the page lends: {get, engine, make, button, number, level, stretch}
let sha = null, page = null, asked = 0;
let view = {joint: 0, part: "test", from: null, to: null, before: null}; // what a link keeps
let touched = false; // the user chose what to look at: nothing else chooses for him
let brush = null, cursor = null, frames = null, cloud = null, whole = null, mode = "zoom";
const place = name => at("workspace-" + name), plot = name => place(name).querySelector(".plot");

// ---- a link that keeps what is looked at
function remembered() {
  const words = new URLSearchParams(location.search), value = key => words.has(key) && isFinite(Number(words.get(key))) ? Number(words.get(key)) : null;
  const named = page.joints.findIndex(j => j.name === words.get("joint"));
  if (named >= 0) view.joint = named;
  if (["test", "train"].includes(words.get("logs"))) view.part = words.get("logs");
  view.from = value("from"); view.to = value("to");
  if (words.has("before")) view.before = value("before");
  touched = touched || named >= 0;
}
function kept() {
  if (!touched) return;
  const words = new URLSearchParams(location.search);
  const put = (key, value) => value === null || value === undefined ? words.delete(key) : words.set(key, value);
  put("joint", page.joints[view.joint].name); put("logs", view.part === "test" ? null : view.part);
  put("from", view.from === null ? null : view.from.toFixed(4)); put("to", view.to === null ? null : view.to.toFixed(4));
  put("before", view.before);
  history.replaceState(null, "", location.pathname + "?" + words + location.hash);
}

// ---- its elements
function build(section, lent) {
  tools = lent;
  const {make, button} = tools;
  const figure = (name, height, label) => make("figure", {class: "look", id: "workspace-" + name, style: "--height:" + height + "px", tabindex: name === "time" ? "0" : null, "aria-label": label},
    make("div", {class: "plot"}, make("p", {class: "waiting"}, "drawing…")),
    make("figcaption", {class: "take"}, ...["PNG", "SVG", "CSV"].map(kind => button(kind, () => take(name, kind), {"aria-label": "save " + label + " as " + kind, "data-take": name + "-" + kind}))));
  const parts = make("select", {id: "workspace-part", "aria-label": "which logs"}, make("option", {value: "test"}, "test logs (held out)"), make("option", {value: "train"}, "training logs"));
  parts.addEventListener("change", () => { touched = true; view.part = parts.value; view.from = view.to = brush = cursor = null; all(); });
  const before = make("select", {id: "workspace-before", "aria-label": "compared with"});
  before.addEventListener("change", () => { touched = true; view.before = before.value === "" ? null : Number(before.value); time(); });
  const way = (word, what, label) => button(word, () => shift(what), label ? {"aria-label": label} : {});
  section.replaceChildren(make("h2", {id: "workspace-title", tabindex: "-1"}, "One joint from all sides"),
    make("div", {class: "acts", id: "workspace-joints", role: "group", "aria-label": "joint"}),
    make("p", {id: "workspace-fall", class: "lead", "aria-live": "polite"}),
    make("div", {class: "acts"}, parts, make("label", {class: "quiet"}, "beside ", before)),
    make("div", {class: "acts", role: "group", "aria-label": "time"}, way("zoom in", "in"), way("zoom out", "out"), way("←", "back", "earlier"), way("→", "on", "later"), way("whole", "all"),
      button("drag zooms", () => drags("zoom"), {id: "drag-zoom", "aria-pressed": "true"}), button("drag brushes", () => drags("select"), {id: "drag-brush", "aria-pressed": "false"}),
      button("no brush", () => brushed(null), {id: "brush-none"}), button("play", play, {id: "workspace-play", "aria-pressed": "false"})),
    make("p", {id: "workspace-said", class: "answer", "aria-live": "polite"}),
    make("div", {class: "timeplace"}, figure("time", 400, "torque and residual over time"), make("div", {id: "workspace-cursor", hidden: true})),
    make("p", {id: "workspace-brush", class: "quiet", "aria-live": "polite"}),
    make("p", {id: "workspace-clock", class: "quiet"}, "Move over a chart: all of them show that moment. Keys on the time chart: ← → the cursor, + − zoom, 0 the whole, Shift with ← → moves the window, [ ] the joint."),
    make("div", {class: "grid", id: "workspace-panels"}, figure("position", 300, "residual against position"), figure("speed", 300, "residual against speed"), figure("map", 300, "mean residual over position and speed"), figure("robot", 300, "the robot")));
  place("time").addEventListener("keydown", keyed);
  addEventListener("resize", () => { if (cursor !== null) lineAt(cursor); });
}
function show(found, seen) {
  const first = page === null, grew = page && found.steps.length > page.steps.length;
  page = found; sha = seen; frames = null;
  view.joint = Math.min(view.joint, page.joints.length - 1);
  if (first) remembered();
  if (grew) { view.before = page.steps.length - 2; view.from = view.to = null; }
  if (view.before !== null && view.before >= page.steps.length - 1) view.before = null;
  const {make, button} = tools;
  at("workspace-joints").replaceChildren(...page.joints.map((j, k) => button(j.name, () => to(k), {"aria-pressed": String(k === view.joint), "data-key": "joint" + k})));
  at("workspace-before").replaceChildren(make("option", {value: ""}, "nothing"), ...page.steps.slice(0, -1).map((s, k) => make("option", {value: k, disabled: !page.kept.includes(k)}, "step " + k + ": " + s + (page.kept.includes(k) ? "" : " (not in memory)"))));
  if (view.before !== null && !page.kept.includes(view.before)) view.before = null;
  at("workspace-part").value = view.part;
}
function suggest(k) { if (!touched) view.joint = k; }
function to(k) { touched = true; view.joint = k; brush = null; return all(); }
async function all() { await Promise.all([time(), sides(), robot()]); }

// ---- asked of the server, drawn
async function time() {
  const own = ++asked;
  [...at("workspace-joints").children].forEach((b, k) => b.setAttribute("aria-pressed", String(k === view.joint)));
  at("workspace-before").value = view.before === null ? "" : String(view.before);
  kept();
  const words = {sha, joint: view.joint, part: view.part, ...(view.from === null ? {} : {from: view.from, to: view.to}), ...(view.before === null ? {} : {before: view.before})};
  try {
    const [found] = await Promise.all([tools.get("api/window", words), tools.engine()]);
    if (own !== asked) return;
    whole = found.whole;
    const fresh = !plot("time").data;
    found.chart.figure.layout.uirevision = "window" + own; // what is in sight is what was asked for
    found.chart.figure.layout.dragmode = mode;
    place("time").setAttribute("aria-label", found.chart.label);
    place("time").base = found.chart.figure.layout.shapes || [];
    window.sysid.show(place("time"), found.chart);
    if (fresh) listen();
    paint();
    const {level} = tools, unit = " " + found.unit, rows = view.part === "test" ? "test logs" : "training logs";
    at("workspace-said").textContent = found.joint + ": residual RMS " + level(found.rms) + unit + " over the " + rows + (view.from === null ? "" : "; " + level(found.here) + unit + " in sight, " + found.from.toFixed(2) + " to " + found.to.toFixed(2) + " s")
      + (found.drawn < found.samples ? ". " + found.samples.toLocaleString("en") + " samples in sight, thinned: every peak is kept" : ". Every one of " + found.samples.toLocaleString("en") + " samples in sight is drawn") + "."
      + (found.left_out ? " " + found.left_out.toLocaleString("en") + " of them, where the residual has gaps, are left out of the fit and of its error." : "");
    fell(found);
    if (cursor !== null) lineAt(cursor);
  } catch (error) { if (own === asked) at("workspace-said").textContent = error.message; }
}
function fell(found) { // the falling error, first thing after an addition
  const {level} = tools, by = found.before ? (found.rms - found.before) / found.before : null;
  at("workspace-fall").textContent = by === null ? "" : found.joint + ": " + level(found.before) + " → " + level(found.rms) + " " + found.unit + " RMS " + (view.part === "test" ? "held out" : "on the training logs") + ", " + (by <= 0 ? "−" : "+") + Math.abs(100 * by).toFixed(by > -0.1 && by < 0.1 ? 1 : 0) + " % against step " + view.before + " (" + page.steps[view.before] + ").";
}
let clouds = 0;
async function sides() {
  const own = ++clouds;
  try {
    const [found] = await Promise.all([tools.get("api/cloud", {sha, joint: view.joint, part: view.part}), tools.engine()]);
    if (own !== clouds) return;
    cloud = found;
    for (const name of ["position", "speed", "map"]) {
      const fresh = !plot(name).data;
      found[name].figure.layout.uirevision = "cloud" + own;
      place(name).setAttribute("aria-label", found[name].label);
      window.sysid.show(place(name), found[name]);
      if (!fresh) continue;
      plot(name).on("plotly_hover", event => { const k = event.points[0]; if (name !== "map" && k.curveNumber === 0) moved(cloud.t[k.pointNumber]); });
      if (name !== "map") plot(name).on("plotly_selected", event => { if (event && event.points) brushed(event.points.filter(p => p.curveNumber === 0).map(p => p.pointNumber)); else brushed(null); });
    }
    paint();
  } catch (error) { if (own === clouds) for (const name of ["position", "speed", "map"]) if (!plot(name).data) plot(name).textContent = error.message; }
}
async function robot() {
  if (frames && frames.part === view.part && frames.sha === sha) return;
  const own = sha, part = view.part;
  try {
    const [found] = await Promise.all([tools.get("api/film", {sha, part}), tools.engine()]);
    if (own !== sha || part !== view.part) return;
    frames = {...found, sha: own, part};
    place("robot").setAttribute("aria-label", found.chart.label);
    window.sysid.show(place("robot"), found.chart);
  } catch (error) { if (!plot("robot").data) plot("robot").textContent = error.message; }
}

// ---- zoom
let wait = null;
function listen() {
  plot("time").on("plotly_relayout", change => {
    let range = null;
    if (change["xaxis.range[0]"] !== undefined) range = [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    else if (Array.isArray(change["xaxis.range"])) range = change["xaxis.range"];
    else if (!change["xaxis.autorange"]) return;
    clearTimeout(wait);
    wait = setTimeout(() => sight(range), 60);
  });
  plot("time").on("plotly_doubleclick", () => { clearTimeout(wait); sight(null); });
  plot("time").on("plotly_hover", event => moved(event.xvals ? event.xvals[0] : event.points[0].x));
  plot("time").on("plotly_selected", event => { if (event && event.range && event.range.x) stretchOf(...event.range.x); });
}
function sight(range) {
  touched = true;
  if (range && whole && range[0] <= whole[0] && range[1] >= whole[1]) range = null;
  [view.from, view.to] = range || [null, null];
  return time();
}
function shift(what) {
  if (!whole) return;
  const [a, b] = view.from === null ? whole : [view.from, view.to], width = b - a, middle = (a + b) / 2;
  if (what === "all") return sight(null);
  if (what === "in") return sight([middle - width / 4, middle + width / 4]);
  if (what === "out") return sight([middle - width, middle + width]);
  const by = (what === "on" ? 1 : -1) * width / 2;
  return sight([a + by, b + by]);
}
function drags(what) {
  mode = what;
  at("drag-zoom").setAttribute("aria-pressed", String(what === "zoom")); at("drag-brush").setAttribute("aria-pressed", String(what === "select"));
  if (plot("time").data) Plotly.relayout(plot("time"), {dragmode: what});
}
function keyed(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || !whole) return;
  const zoom = {"+": "in", "=": "in", "-": "out", "0": "all"}[event.key], arrow = {ArrowLeft: -1, ArrowRight: 1}[event.key], turn = {"[": -1, "]": 1}[event.key];
  if (!zoom && !arrow && !turn) return;
  event.preventDefault();
  if (zoom) return shift(zoom);
  if (turn) return to((view.joint + turn + page.joints.length) % page.joints.length);
  if (event.shiftKey) return shift(arrow > 0 ? "on" : "back");
  const [a, b] = view.from === null ? whole : [view.from, view.to];
  moved(Math.min(b, Math.max(a, (cursor === null ? a : cursor) + arrow * (b - a) / 100)));
}

// ---- the cursor
let due = false;
function moved(t) { cursor = t; if (!due) { due = true; requestAnimationFrame(() => { due = false; pointed(); }); } }
function nearest(times, t) {
  let low = 0, high = times.length - 1;
  while (high - low > 1) { const middle = (low + high) >> 1; if (times[middle] < t) low = middle; else high = middle; }
  return Math.abs(times[low] - t) <= Math.abs(times[high] - t) ? low : high;
}
function lineAt(t) {
  const line = at("workspace-cursor"), layout = plot("time")._fullLayout;
  if (!layout) return;
  const axis = layout.xaxis, x = axis._offset + axis.l2p(t);
  line.hidden = x < axis._offset - 1 || x > axis._offset + axis._length + 1;
  line.style.left = plot("time").offsetLeft + x + "px";
  line.style.top = plot("time").offsetTop + layout._size.t + "px";
  line.style.height = layout._size.h + "px";
}
function pointed() {
  if (!cloud || !cloud.t.length || cursor === null) return;
  lineAt(cursor);
  const k = nearest(cloud.t, cursor), dots = name => plot(name).data ? plot(name).data[0] : null;
  const p = dots("position"), s = dots("speed");
  if (!p || !s) return;
  Plotly.restyle(plot("position"), {x: [[p.x[k]]], y: [[p.y[k]]]}, [1]);
  Plotly.restyle(plot("speed"), {x: [[s.x[k]]], y: [[s.y[k]]]}, [1]);
  if (plot("map").data) Plotly.restyle(plot("map"), {x: [[p.x[k]]], y: [[s.x[k]]]}, [1]);
  if (frames && plot("robot").data) {
    const f = nearest(frames.t, cursor), [x, y, z] = frames.links[f], [u, v, w] = frames.joints[f];
    Plotly.restyle(plot("robot"), {x: [x, u], y: [y, v], z: [z, w]}, [0, 1]);
  }
  const words = tools.number, slides = cloud.unit === "N";
  at("workspace-clock").textContent = cursor.toFixed(3) + " s: residual " + words(p.y[k]) + " " + cloud.unit + " at " + words(p.x[k]) + (slides ? " m, " : " rad, ") + words(s.x[k]) + (slides ? " m/s" : " rad/s");
}

let film = null;
function play() { // the log in its own time, and again from the start of what is in sight
  const stop = () => { clearInterval(film); film = null; at("workspace-play").setAttribute("aria-pressed", "false"); at("workspace-play").textContent = "play"; };
  if (film !== null) return stop();
  if (!whole) return;
  at("workspace-play").setAttribute("aria-pressed", "true"); at("workspace-play").textContent = "pause";
  let last = performance.now();
  film = setInterval(() => {
    if (!at("workspace-play").isConnected) return stop();
    const now = performance.now(), [a, b] = view.from === null ? whole : [view.from, view.to], next = (cursor === null ? a : cursor) + (now - last) / 1000;
    last = now;
    moved(next > b || next < a ? a : next);
  }, 60);
}

// ---- the brush: a set of dots, whichever chart it was drawn in
function stretchOf(a, b) {
  if (!cloud) return;
  const [low, high] = [Math.min(a, b), Math.max(a, b)];
  brushed(cloud.t.map((t, k) => [t, k]).filter(([t]) => t >= low && t <= high).map(([, k]) => k));
  if (tools.stretch && view.part === "test") tools.stretch(low, high);
}
function brushed(chosen) { brush = chosen && chosen.length ? [...chosen].sort((a, b) => a - b) : null; paint(); }
function paint() {
  if (!cloud) return;
  for (const name of ["position", "speed"]) if (plot(name).data) Plotly.restyle(plot(name), {selectedpoints: [brush]}, [0]).then(() => { if (!brush && plot(name)._fullLayout.selections && plot(name)._fullLayout.selections.length) Plotly.relayout(plot(name), {selections: []}); });
  if (!plot("time").data) return;
  const runs = [];
  if (brush) {
    const usual = cloud.t.length > 1 ? (cloud.t.at(-1) - cloud.t[0]) / (cloud.t.length - 1) : 0;
    for (const k of brush) { const run = runs.at(-1); if (run && k === run.last + 1) { run.last = k; run.to = cloud.t[k]; } else runs.push({last: k, from: cloud.t[k], to: cloud.t[k]}); }
    for (const run of runs) { run.from -= usual / 2; run.to += usual / 2; }
  }
  const shapes = runs.slice(0, 300).map(run => ({type: "rect", xref: "x", yref: "paper", x0: run.from, x1: run.to, y0: 0, y1: 1, fillcolor: "#0072B2", opacity: 0.18, line: {width: 0}, layer: "below", name: "brush"}));
  Plotly.relayout(plot("time"), {shapes: [...(place("time").base || []), ...shapes], ...(brush ? {} : {selections: []})});
  const words = brush ? brush.length + " of " + cloud.t.length + " rows brushed, in " + runs.length + (runs.length === 1 ? " stretch" : " stretches") + " of time: RMS " + tools.level(Math.sqrt(brush.reduce((sum, k) => sum + cloud.position.figure.data[0].y[k] ** 2, 0) / brush.length)) + " " + cloud.unit + "." : "";
  at("workspace-brush").textContent = words;
}

// ---- taken along
function saved(name, text, kind) {
  const link = tools.make("a", {href: URL.createObjectURL(new Blob([text], {type: kind})), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
async function take(name, kind) {
  const file = [document.title.split(" ·")[0], page.joints[view.joint].name, name].join("-").replace(/[^\w.-]+/g, "_"), own = plot(name);
  if (!own.data) return;
  if (kind !== "CSV") { await Plotly.downloadImage(own, {format: kind.toLowerCase(), filename: file, width: own.offsetWidth, height: own.offsetHeight, scale: kind === "PNG" ? 2 : 1}); return; }
  if (name === "time") { // every sample in sight, not the drawn ones
    const words = new URLSearchParams({sha, joint: view.joint, part: view.part, ...(view.from === null ? {} : {from: view.from, to: view.to})});
    tools.make("a", {href: "export/rows.csv?" + words, download: file + ".csv"}).click();
    return;
  }
  saved(file + ".csv", rowsOf(own).map(row => row.join(",")).join("\n") + "\n", "text/csv");
}
function rowsOf(own) {
  const first = own.data[0], layout = own.layout, title = axis => layout[axis] && layout[axis].title ? layout[axis].title.text : axis;
  if (first.type === "heatmap") return [["q", "qd", "mean residual", "rows"], ...first.y.flatMap((y, r) => first.x.map((x, c) => [x, y, first.z[r][c] ?? "", first.customdata[r][c]]))];
  if (first.type === "scatter3d") return [["x", "y", "z"], ...first.x.map((x, k) => [x ?? "", first.y[k] ?? "", first.z[k] ?? ""])];
  return [["t [s]", title("xaxis"), title("yaxis")], ...first.x.map((x, k) => [first.customdata[k], x, first.y[k]])];
}
window.sysid.workspace = {build, show, all, to, suggest, view, cursorAt: moved, brush: () => brush, cursor: () => cursor};
})();
