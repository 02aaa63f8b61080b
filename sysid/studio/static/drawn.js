// The charts of one joint, asked of the server and drawn: over time, against position and speed,
// the robot; and what part of the time is in sight.
(() => {
"use strict";
const {sysid} = window, {at, get, engine, level, change} = sysid.page;
const {view, seen, place, plot, kept, named} = sysid.workspace;
const held = {cloud: null, frames: null, whole: null}; // what the server answered last
let asked = 0, clouds = 0, mode = "zoom", wait = null;

const window_ = () => ({sha: seen.sha, joint: view.joint, part: view.part, shown: view.shown,
  ...(view.from === null ? {} : {from: view.from, to: view.to})});

// ---- over time
async function time() {
  const own = ++asked;
  [...at("workspace-joints").children].forEach((one, k) => one.setAttribute("aria-pressed",
    String(k === view.joint)));
  kept();
  try {
    const words = {...window_(), beside: view.beside};
    const [found] = await Promise.all([get("api/window", words), engine()]);
    if (own !== asked) return;
    held.whole = found.whole;
    const fresh = !plot("time").data, {layout} = found.chart.figure;
    layout.uirevision = "window" + own; // what is in sight is what was asked for
    layout.dragmode = mode;
    place("time").setAttribute("aria-label", found.chart.label);
    place("time").base = layout.shapes || [];
    sysid.show(place("time"), found.chart);
    if (fresh) listen();
    sysid.brush.paint();
    told(found);
    sysid.cursor.placed();
  } catch (error) {
    if (own === asked) at("workspace-said").textContent = error.message;
  }
}

function told(found) {
  const unit = " " + found.unit, rows = view.part === "test" ? "test logs" : "training logs";
  const count = value => value.toLocaleString("en");
  const part = view.from === null ? "" : "; " + level(found.here) + unit + " in sight, "
    + found.from.toFixed(2) + " to " + found.to.toFixed(2) + " s";
  const drawn = found.drawn < found.samples
    ? count(found.samples) + " samples in sight, thinned: every peak is kept."
    : "Every one of " + count(found.samples) + " samples in sight is drawn.";
  const left = found.left_out ? " " + count(found.left_out) + " of them, where the residual has "
    + "gaps, are left out of the fit and of its error." : "";
  at("workspace-said").textContent = found.joint + ": residual RMS " + level(found.rms) + unit
    + " over the " + rows + ", " + found.band + part + ". " + drawn + left;
  fell(found);
}

function fell(found) { // against what is laid beside
  const {beside, rms: now} = found, unit = " " + found.unit;
  if (!beside) {
    at("workspace-fall").textContent = "";
    return;
  }
  const rows = view.part === "test" ? "held out" : "on the training logs";
  at("workspace-fall").textContent = found.joint + ": " + level(beside) + " → " + level(now)
    + unit + " RMS " + rows + ", " + change(beside, now) + ": " + named(view.shown) + ", against "
    + named(view.beside) + (found.laid ? "." : "; its rows are others and are not drawn.");
}

// ---- against position and speed, and the robot
async function sides() {
  const own = ++clouds, panels = ["position", "speed", "map"];
  try {
    const words = {sha: seen.sha, joint: view.joint, part: view.part, shown: view.shown};
    const [found] = await Promise.all([get("api/cloud", words), engine()]);
    if (own !== clouds) return;
    held.cloud = found;
    for (const name of panels) {
      const fresh = !plot(name).data;
      found[name].figure.layout.uirevision = "cloud" + own;
      place(name).setAttribute("aria-label", found[name].label);
      sysid.show(place(name), found[name]);
      if (fresh) heard(name);
    }
    sysid.brush.paint();
  } catch (error) {
    if (own !== clouds) return;
    for (const name of panels) if (!plot(name).data) plot(name).textContent = error.message;
  }
}

function heard(name) {
  plot(name).on("plotly_hover", event => {
    const k = event.points[0];
    if (name !== "map" && k.curveNumber === 0) sysid.cursor.moved(held.cloud.t[k.pointNumber]);
  });
  if (name === "map") return;
  plot(name).on("plotly_selected", event => sysid.brush.set(event && event.points
    ? event.points.filter(p => p.curveNumber === 0).map(p => p.pointNumber) : null));
}

async function robot() {
  const {frames} = held, {sha} = seen, {part} = view;
  if (frames && frames.part === part && frames.sha === sha) return;
  try {
    const [found] = await Promise.all([get("api/film", {sha, part}), engine()]);
    if (sha !== seen.sha || part !== view.part) return;
    held.frames = {...found, sha, part};
    place("robot").setAttribute("aria-label", found.chart.label);
    sysid.show(place("robot"), found.chart);
  } catch (error) {
    if (!plot("robot").data) plot("robot").textContent = error.message;
  }
}

const all = () => Promise.all([time(), sides(), robot()]);

// ---- the part of the time in sight
function listen() {
  plot("time").on("plotly_relayout", changed => {
    let range = null;
    const low = changed["xaxis.range[0]"];
    if (low !== undefined) range = [low, changed["xaxis.range[1]"]];
    else if (Array.isArray(changed["xaxis.range"])) range = changed["xaxis.range"];
    else if (!changed["xaxis.autorange"]) return;
    clearTimeout(wait);
    wait = setTimeout(() => sight(range), 60);
  });
  plot("time").on("plotly_doubleclick", () => {
    clearTimeout(wait);
    sight(null);
  });
  plot("time").on("plotly_hover", event => sysid.cursor.moved(event.xvals ? event.xvals[0]
    : event.points[0].x));
  plot("time").on("plotly_selected", event => {
    if (event && event.range && event.range.x) sysid.brush.stretch(...event.range.x);
  });
}

function sight(range) {
  const {whole} = held;
  seen.touched = true;
  if (range && whole && range[0] <= whole[0] && range[1] >= whole[1]) range = null;
  [view.from, view.to] = range || [null, null];
  return time();
}

const inSight = () => view.from === null ? held.whole : [view.from, view.to];

function shift(what) {
  if (held.whole) sight(sysid.time.stepped(what, inSight(), held.whole));
}

function drags(what) {
  mode = what;
  at("drag-zoom").setAttribute("aria-pressed", String(what === "zoom"));
  at("drag-brush").setAttribute("aria-pressed", String(what === "select"));
  if (plot("time").data) Plotly.relayout(plot("time"), {dragmode: what});
}

function keyed(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || !held.whole) return;
  const arrow = {ArrowLeft: -1, ArrowRight: 1}[event.key], turn = {"[": -1, "]": 1}[event.key];
  const what = sysid.time.KEYS[event.key], joints = seen.page.joints.length;
  if (!what && !turn) return;
  event.preventDefault();
  if (turn) sysid.workspace.to((view.joint + turn + joints) % joints);
  else if (!arrow || event.shiftKey) shift(what);
  else sysid.cursor.stepped(arrow, inSight());
}

// ---- taken along
const file = name => [document.title.split(" ·")[0], seen.page.joints[view.joint].name, name]
  .join("-");
const rows = () => "export/rows.csv?" + new URLSearchParams(window_()); // every sample in sight

sysid.drawn = {all, time, shift, drags, keyed, inSight, held, file, rows};
})();
