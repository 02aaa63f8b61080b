// The sections of the page: the report's own, made and escaped by the server, with buttons; and the
// falling error, the first thing seen after a change.
(() => {
"use strict";
const {sysid} = window, {at, make, button, table, number, level, change, get, engine} = sysid.page;
const {stands, act} = sysid.standing;
const SHORT = {
  verdict: "Verdict", workspace: "Joint", steps: "Steps", suspects: "Suspects", torque: "Torque",
  failures: "Where", detectable: "Could show", parameters: "Parameters", bodies: "Bodies",
  provenance: "Provenance",
};
const AT_WORK = "The fit stands; it is being diagnosed. Its charts are below.";
let page = null; // what is shown
const on = (effect, where) => where === "*" ? effect : effect + " to " + where;
// of the page that is shown, each as it came or while it is asked for: paper waits for no answer
const charts = new Map();
sysid.figure = id => {
  if (!charts.has(id)) charts.set(id, asked(id));
  return charts.get(id);
};
async function asked(id) {
  const sha = stands.shown;
  const keep = (key, chart) => sha === stands.shown && charts[key](id, chart);
  try {
    const [chart] = await Promise.all([get("api/figure", {sha, id}), engine()]);
    keep("set", chart);
    return chart;
  } catch (error) {
    keep("delete"); // to be asked for again
    throw error;
  }
}

async function allAsked(sha) { // one after another, so that nothing waits for them
  for (const place of document.querySelectorAll("#sections figure.chart[data-chart]")) {
    if (stands.shown !== sha) return;
    try {
      await sysid.figure(place.dataset.chart);
    } catch { /* who looks at it is told why */ }
  }
}

function places(order) { // one for each section, in the page's order; empty ones are not seen
  for (const name of order) {
    if (at(name)) continue;
    at("sections").append(make("section", {id: name, "aria-labelledby": name + "-title"}));
    at("links").append(make("li", {}, make("a", {href: "#" + name}, SHORT[name] || name)));
  }
}

function linked() {
  for (const one of at("links").children) {
    one.hidden = !at(one.firstChild.hash.slice(1)).childElementCount;
  }
}

const titled = (name, words) => make("h2", {id: name + "-title", tabindex: "-1"}, words);

// ---- what the last change did
function fell(found) {
  const steps = found.steps.length - 1, most = found.falls;
  at("fall").hidden = !steps || !most.length;
  if (at("fall").hidden) return;
  const first = most[0], by = first.to <= first.from ? "falls" : "rises";
  const words = found.steps[steps].replace(/^\+ /, "") + ": the held-out error of "
    + first.joint + " " + by + " from " + level(first.from) + " to " + level(first.to) + " "
    + first.unit + " (" + change(first.from, first.to) + ").";
  const rows = most.slice(0, 7).map(f => [f.joint, level(f.from) + " " + f.unit,
    level(f.to) + " " + f.unit, make("td", {class: f.to <= f.from ? "falls" : "rises"},
      make("span", {class: "drop", "aria-hidden": "true", style: "--now:"
        + (100 * f.to / Math.max(f.from, f.to)).toFixed(1) + "%"}), change(f.from, f.to))]);
  at("fall").replaceChildren(make("p", {class: "lead"}, words),
    make("details", {open: most.length < 4}, make("summary", {}, "every joint"), table(
      "held-out error before and after the last step",
      ["joint", "RMS, test logs, before", "after", "change"], rows)));
}

// ---- sections
async function showFit(sha) {
  const found = await get("api/fitted", {sha});
  if (stands.shown === sha || stands.looking !== sha) return;
  stands.early = sha;
  places(found.order);
  if (!at("verdict-title")) {
    at("verdict").append(titled("verdict", "Verdict"), make("p", {class: "lead"}, AT_WORK),
      make("p", {id: "so-far", class: "quiet", "aria-live": "polite"}));
    at("suspects").append(titled("suspects", "Try an effect"));
    sysid.remedies.build(found);
  }
  const drawn = workspace(found, sha, true);
  linked();
  await drawn;
}

function soFar(names) { // what joined while the diagnosis is at work
  const place = at("so-far"), words = names.length ? "Asked so far, each with those before it: "
    + names.join("; ") + ". The verdict follows when all of them are weighed." : "";
  if (place && place.textContent !== words) place.textContent = words;
}

async function workspace(found, sha, fresh) {
  const section = at("workspace");
  if (!section.childElementCount) sysid.workspace.build(section);
  section.classList.toggle("fresh", fresh);
  at("fall").classList.toggle("fresh", fresh);
  fell(found);
  sysid.workspace.show(found, sha);
  if (!fresh && found.first) sysid.workspace.suggest(found.first);
  await sysid.workspace.all();
}

async function show(sha) {
  const found = await get("api/view", {sha}), active = document.activeElement;
  const focus = active && active.dataset ? active.dataset.key : null;
  const lost = at("sections").contains(active);
  const anew = stands.shown === null;
  stands.shown = sha;
  charts.clear();
  page = found;
  const worst = page.verdict.findIndex(v => v.status === "missing");
  if (anew && worst >= 0) found.first = worst;
  places(page.order);
  for (const name of page.order) {
    if (name === "workspace") continue;
    const section = at(name), part = page.sections[name];
    section.innerHTML = part.html; // made and escaped by the server, as in the report
    section.prepend(titled(name, part.title));
  }
  workspace(found, sha, false).then(() => allAsked(sha));
  offers();
  sysid.remedies.build(page);
  compared();
  linked();
  sysid.begin();
  if (!lost) return;
  const again = [...document.querySelectorAll("[data-key]")].find(e => e.dataset.key === focus);
  (focus && again || at("verdict-title")).focus({preventScroll: Boolean(focus && again)});
}

function offers() {
  const lead = at("verdict").querySelector(".lead");
  if (!lead || !page.offered.length) return;
  const add = (words, body, key, kind) => button(words, () => act("api/add", body),
    {"data-acts": true, class: kind, "data-key": key});
  const acts = page.offered.slice(0, 4).map((offer, k) => add("add "
    + on(offer.effect, offer.joint), {finding: offer.finding}, "offer" + k, k ? "" : "first"));
  if (page.offered.length > 1) {
    acts.push(add("add all " + page.offered.length + " steps", {steps: true}, "offer-all", ""));
  }
  lead.after(make("div", {class: "acts"}, ...acts));
}

// ---- two steps compared
function compared() {
  if (page.steps.length < 2) return;
  const options = () => page.steps.map((step, k) => make("option", {value: k}, k + ": " + step));
  const one = make("select", {}, ...options()), other = make("select", {}, ...options());
  const answer = make("div", {class: "answer", "aria-live": "polite"});
  one.value = String(page.steps.length - 2);
  other.value = String(page.steps.length - 1);
  const row = entry => {
    const {unit} = page.joints.find(j => j.name === entry.joint) || {unit: ""};
    const by = (entry.delta > 0 ? "+" : "") + number(entry.delta, 3)
      + (entry.se ? " ± " + number(entry.se, 2) : "") + " " + unit;
    const kind = entry.delta < 0 ? "falls" : entry.delta > 0 ? "rises" : "";
    return [entry.joint, level(entry.from) + " " + unit, level(entry.to) + " " + unit,
      make("td", {class: kind}, by)];
  };
  const ask = async () => {
    try {
      const found = await get("api/compare", {from: one.value, to: other.value});
      const heads = ["joint", "held-out RMS, first", "second", "difference"];
      answer.replaceChildren(table("two steps compared", heads, found.joints.map(row)));
    } catch (error) {
      answer.textContent = error.message;
    }
  };
  one.addEventListener("change", ask);
  other.addEventListener("change", ask);
  at("steps").append(make("h3", {}, "Compare steps"),
    make("form", {class: "own", onsubmit: event => event.preventDefault()},
      make("label", {}, "first", one), make("label", {}, "second", other)), answer);
  ask();
}

sysid.sections = {show, showFit, soFar, on};
})();
