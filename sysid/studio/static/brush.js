// One brush through all charts of a joint: a set of dots, whichever chart it was drawn in; and what
// can be asked and done about a stretch of time.
(() => {
"use strict";
const {sysid} = window, {at, make, button, table, level, number, get} = sysid.page;
const {view, seen, place, plot} = sysid.workspace;
const BLUE = "#0072B2", MOST = 300; // stretches that are drawn
let brush = null;
const cloud = () => sysid.drawn.held.cloud;

function set(chosen) {
  brush = chosen && chosen.length ? [...chosen].sort((a, b) => a - b) : null;
  paint();
}

function stretch(a, b) { // brushed over time
  if (!cloud()) return;
  const [low, high] = [Math.min(a, b), Math.max(a, b)];
  set(cloud().t.map((t, k) => [t, k]).filter(([t]) => t >= low && t <= high).map(([, k]) => k));
  at("stretch-from").value = low.toFixed(3);
  at("stretch-to").value = high.toFixed(3);
  at("stretch").open = true;
  ask();
}

function runsOf(dots, t) { // dots that follow each other, as stretches of time
  const usual = t.length > 1 ? (t.at(-1) - t[0]) / (t.length - 1) : 0, runs = [];
  for (const k of dots) {
    const run = runs.at(-1);
    if (run && k === run.last + 1) Object.assign(run, {last: k, to: t[k]});
    else runs.push({last: k, from: t[k], to: t[k]});
  }
  return runs.map(run => [run.from - usual / 2, run.to + usual / 2]);
}

function paint() {
  if (!cloud()) return;
  for (const name of ["position", "speed"]) if (plot(name).data) {
    Plotly.restyle(plot(name), {selectedpoints: [brush]}, [0]).then(() => {
      const drawn = plot(name)._fullLayout.selections;
      if (!brush && drawn && drawn.length) Plotly.relayout(plot(name), {selections: []});
    });
  }
  if (!plot("time").data) return;
  const {t, position, unit} = cloud(), runs = brush ? runsOf(brush, t) : [];
  const shapes = runs.slice(0, MOST).map(([x0, x1]) => ({
    type: "rect", xref: "x", yref: "paper", x0, x1, y0: 0, y1: 1, fillcolor: BLUE, opacity: 0.18,
    line: {width: 0}, layer: "below", name: "brush",
  }));
  const base = place("time").base || [], none = brush ? {} : {selections: []};
  Plotly.relayout(plot("time"), {shapes: [...base, ...shapes], ...none});
  if (!brush) {
    at("workspace-brush").textContent = "";
    return;
  }
  const {y} = position.figure.data[0], square = brush.reduce((sum, k) => sum + y[k] ** 2, 0);
  at("workspace-brush").textContent = brush.length + " of " + t.length + " dots brushed, in "
    + runs.length + (runs.length === 1 ? " stretch" : " stretches") + " of time: RMS "
    + level(Math.sqrt(square / brush.length)) + " " + unit + " of these dots.";
}

// ---- a stretch of time
const ends = () => ["stretch-from", "stretch-to"].map(id => at(id).value);
const given = () => ends().every(value => value !== "");

async function ask() {
  const answer = at("stretch-answer"), [from, to] = ends();
  if (!given()) return;
  try {
    const found = await get("api/stretch", {sha: seen.sha, part: view.part, from, to});
    if (!found.rows) {
      answer.textContent = "No row of these logs lies there.";
      return;
    }
    const rows = found.joints.map(j => [j.joint, level(j.here) + " " + j.unit,
      level(j.whole) + " " + j.unit, j.whole > 0 ? number(j.here / j.whole, 2) + " ×" : "–"]);
    const takes = found.previews.map(one => make("li", {}, one.words + " would take "
      + Math.round(100 * one.share) + " % of the squared residual of " + one.joint + " here. ",
    button("show", () => sysid.workspace.previewed(one.sha, -1))));
    const none = "No change that was previewed explains what is missed here: preview a suspect.";
    answer.replaceChildren(make("h3", {}, "Between " + number(found.from, 4) + " and "
      + number(found.to, 4) + " s"), takes.length ? make("ul", {}, ...takes)
      : make("p", {class: "quiet"}, none),
    table("residual in that stretch of time", ["joint", "RMS here", "RMS of all", "ratio"], rows));
  } catch (error) {
    answer.textContent = error.message;
  }
}

function mask(joint) {
  if (!given()) return;
  const [from, to] = ends().map(Number), wrong = at("mask-wrong");
  sysid.standing.act("api/add", {mask: {part: view.part, from, to, joint}}, wrong);
}

function form() {
  const box = id => make("input", {type: "number", id, step: "any", min: 0});
  const send = event => {
    event.preventDefault();
    ask();
  };
  const own = {"data-acts": true};
  return make("details", {id: "stretch"}, make("summary", {}, "a stretch of time: what is missed "
    + "there, or leave it out"), make("form", {class: "own", onsubmit: send},
    make("label", {}, "from [s]", box("stretch-from")),
    make("label", {}, "to [s]", box("stretch-to")),
    make("button", {type: "submit"}, "what is missed here?"),
    button("mask it on this joint", () => mask(view.joint), {...own, "data-key": "mask-joint"}),
    button("mask it on every joint", () => mask(null), {...own, "data-key": "mask-all"})),
  make("p", {class: "quiet"}, "Brush over the time chart, or give two times. What is masked counts "
    + "in no fit and in no error; undo brings it back."),
  make("p", {class: "wrong", role: "alert", id: "mask-wrong"}),
  make("div", {id: "stretch-answer", class: "answer", "aria-live": "polite"}));
}

sysid.brush = {set, stretch, paint, form, dots: () => brush, forget: () => { brush = null; }};
})();
