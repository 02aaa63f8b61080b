// One joint from all sides: what is looked at, its elements, and an address that keeps it.
(() => {
"use strict";
const {sysid} = window, {at, make, button} = sysid.page;
const KEYS = "Move over a chart: all of them show that moment. Keys on the time chart: ← → the "
  + "cursor, + − zoom, 0 the whole, Shift with ← → moves the window, [ ] the joint.";
const PANELS = {
  position: "residual against position", speed: "residual against speed",
  map: "mean residual over position and speed", robot: "the robot",
};
// shown, beside: "" for the model as it stands and for nothing; step:2, preview:SHA, run:NAME
const view = {joint: 0, part: "test", from: null, to: null, shown: "", beside: ""};
const seen = {sha: null, page: null, previews: [], touched: false};
const place = name => at("workspace-" + name), plot = name => place(name).querySelector(".plot");

// ---- an address that keeps what is looked at
function remembered() {
  const words = new URLSearchParams(location.search);
  const value = key => words.has(key) && isFinite(Number(words.get(key)))
    ? Number(words.get(key)) : null;
  const named = seen.page.joints.findIndex(j => j.name === words.get("joint"));
  if (named >= 0) view.joint = named;
  if (["test", "train"].includes(words.get("logs"))) view.part = words.get("logs");
  view.from = value("from");
  view.to = value("to");
  view.beside = words.get("beside") || "";
  view.shown = words.get("shown") || "";
  seen.touched = seen.touched || named >= 0;
}

function kept() {
  if (!seen.touched) return;
  const words = new URLSearchParams(location.search);
  const put = (key, value) => value ? words.set(key, value) : words.delete(key);
  put("joint", seen.page.joints[view.joint].name);
  put("logs", view.part === "test" ? null : view.part);
  put("from", view.from === null ? null : view.from.toFixed(4));
  put("to", view.to === null ? null : view.to.toFixed(4));
  put("shown", view.shown);
  put("beside", view.beside);
  history.replaceState(null, "", location.pathname + "?" + words + location.hash);
}

// ---- elements
function figure(name, height, label) {
  const attributes = {class: "look", id: "workspace-" + name, style: "--height:" + height + "px",
    tabindex: name === "time" ? "0" : null, "aria-label": label};
  const made = make("figure", attributes, make("div", {class: "plot"},
    make("p", {class: "waiting"}, "drawing…")));
  made.append(sysid.taken(made, () => sysid.drawn.file(name), name === "time"
    ? () => sysid.drawn.rows() : null));
  return made;
}

function select(id, label, changed) {
  const made = make("select", {id, "aria-label": label});
  made.addEventListener("change", () => {
    seen.touched = true;
    changed(made.value);
  });
  return made;
}

function build(section) {
  const {cursor, drawn} = sysid, shift = what => () => drawn.shift(what);
  const way = (word, what, label) => button(word, shift(what), label ? {"aria-label": label} : {});
  const parts = select("workspace-part", "which logs", value => {
    view.part = value;
    view.from = view.to = null;
    cursor.forget();
    drawn.all();
  });
  parts.append(make("option", {value: "test"}, "test logs (held out)"),
    make("option", {value: "train"}, "training logs"));
  const shown = select("workspace-shown", "which model is shown", value => {
    view.shown = value;
    drawn.all();
  });
  const beside = select("workspace-beside", "what is laid beside", value => {
    view.beside = value;
    drawn.time();
  });
  section.replaceChildren(
    make("h2", {id: "workspace-title", tabindex: "-1"}, "One joint from all sides"),
    make("div", {class: "acts", id: "workspace-joints", role: "group", "aria-label": "joint"}),
    make("p", {id: "workspace-fall", class: "lead", "aria-live": "polite"}),
    make("p", {id: "aside", class: "wrong", role: "alert"}),
    make("div", {class: "acts"}, parts, make("label", {class: "quiet"}, "showing ", shown),
      make("label", {class: "quiet"}, "beside ", beside)),
    make("div", {class: "acts", role: "group", "aria-label": "time"}, way("zoom in", "in"),
      way("zoom out", "out"), way("←", "back", "earlier"), way("→", "on", "later"),
      way("whole", "all"),
      button("drag zooms", () => drawn.drags("zoom"), {id: "drag-zoom", "aria-pressed": "true"}),
      button("drag brushes", () => drawn.drags("select"),
        {id: "drag-brush", "aria-pressed": "false"}),
      button("no brush", () => sysid.brush.set(null), {id: "brush-none"}),
      button("play", cursor.play, {id: "workspace-play", "aria-pressed": "false"})),
    make("p", {id: "workspace-said", class: "answer", "aria-live": "polite"}),
    make("div", {class: "timeplace"}, figure("time", 400, "torque and residual over time"),
      make("div", {id: "workspace-cursor", hidden: true})),
    make("p", {id: "workspace-brush", class: "quiet", "aria-live": "polite"}),
    sysid.brush.form(),
    make("p", {id: "workspace-clock", class: "quiet"}, KEYS),
    make("div", {class: "grid", id: "workspace-panels"},
      ...Object.entries(PANELS).map(([name, label]) => figure(name, 300, label))));
  place("time").addEventListener("keydown", drawn.keyed);
  addEventListener("resize", cursor.placed);
}

// ---- what can be shown, and laid beside
function offers() {
  const {page} = seen, last = page.steps.length - 1, {previews} = seen;
  const steps = page.steps.slice(0, -1).map((step, k) => ["step:" + k, "step " + k + ": " + step
    + (page.kept.includes(k) ? "" : " (not in memory)"), !page.kept.includes(k)]);
  const ahead = previews.map(one => ["preview:" + one.sha, "with " + one.words, false]);
  const runs = page.runs.map(name => ["run:" + name, name, false]);
  const now = ["now", "step " + last + ": " + page.steps[last] + " (now)", false];
  return {now, steps, ahead, runs};
}

function listed(box, none, groups, value) {
  const option = ([key, words, disabled]) => make("option", {value: key, disabled}, words);
  const filled = groups.filter(([, entries]) => entries.length)
    .map(([label, entries]) => make("optgroup", {label}, ...entries.map(option)));
  box.replaceChildren(make("option", {value: ""}, none), ...filled);
  const known = [...box.options].some(one => one.value === value && !one.disabled);
  box.value = known ? value : "";
  return box.value;
}

function choices() {
  const {now, steps, ahead, runs} = offers();
  view.shown = listed(at("workspace-shown"), now[1], [["steps", steps], ["previews", ahead]],
    view.shown);
  view.beside = listed(at("workspace-beside"), "nothing", [
    ["steps", [...steps, ...(view.shown ? [now] : [])]], ["previews", ahead], ["runs", runs],
  ], view.beside);
}

function named(key) { // what is shown or laid beside, in words
  const {now, steps, ahead, runs} = offers();
  const found = [...steps, now, ...ahead, ...runs].find(([own]) => own === (key || "now"));
  return found ? found[1] : key;
}

function show(found, sha) {
  const first = seen.page === null, grew = !first && found.steps.length > seen.page.steps.length;
  if (sha !== seen.sha) seen.previews = [];
  seen.page = found;
  seen.sha = sha;
  sysid.cursor.anew();
  view.joint = Math.min(view.joint, found.joints.length - 1);
  if (first) remembered();
  if (grew) {
    Object.assign(view, {shown: "", beside: "step:" + (found.steps.length - 2), from: null,
      to: null});
  }
  at("workspace-joints").replaceChildren(...found.joints.map((j, k) => button(j.name, () => to(k),
    {"aria-pressed": String(k === view.joint), "data-key": "joint" + k})));
  choices();
  at("workspace-part").value = view.part;
}

function previews(made) { // that there are now
  const key = list => list.map(one => one.sha).join();
  if (key(made) === key(seen.previews)) return;
  seen.previews = made;
  choices();
}

function previewed(sha, joint) { // show one against the model as it stands
  Object.assign(view, {shown: "preview:" + sha, beside: "now"});
  if (joint >= 0) view.joint = joint;
  seen.touched = true;
  choices();
  at("workspace").scrollIntoView({block: "start"});
  return sysid.drawn.all();
}

function to(k) {
  seen.touched = true;
  view.joint = k;
  sysid.brush.set(null);
  return sysid.drawn.all();
}

sysid.workspace = {
  build, show, to, view, seen, place, plot, kept, named, previews, previewed, choices,
  all: () => sysid.drawn.all(), suggest: k => { if (!seen.touched) view.joint = k; },
};
})();
