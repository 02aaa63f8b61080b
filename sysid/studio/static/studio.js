// What the live page does beside what the report does. Every text goes into the page as text, never as markup.
(() => {
"use strict";
const at = id => document.getElementById(id);
const CSRF = document.querySelector('meta[name="sysid-csrf"]').content;
const SHORT = {verdict: "Verdict", workspace: "Joint", steps: "Steps", suspects: "Suspects", look: "Residual", torque: "Torque", failures: "Where", detectable: "Could show", parameters: "Parameters", bodies: "Bodies", provenance: "Provenance"};
// looking: hash of the experiment file that this page is about; shown: that of the results in it; page: these
let looking = null, shown = null, page = null, last = null, busy = false, said = "", told = null;
let joint = 0, finding = null, asked = 0;

function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}
const number = (value, digits = 4) => value === null || value === undefined || !isFinite(value) ? "–" : Number(value).toPrecision(digits).replace(/\.?0+$/, m => m.startsWith(".") ? "" : m).replaceAll("-", "−");
const level = value => value === null || value === undefined ? "–" : Number(value).toPrecision(4).replaceAll("-", "−");
const on = (effect, where) => where === "*" ? effect : effect + " to " + where;

// ---- asking the server
async function answered(response) {
  let body = {};
  try { body = await response.json(); } catch (error) { body = {error: "status " + response.status}; }
  if (!response.ok) throw Object.assign(new Error(body.error || "status " + response.status), {status: response.status});
  return body;
}
async function get(path, words = {}) {
  const query = new URLSearchParams(words).toString();
  return answered(await fetch(path + (query ? "?" + query : ""), {cache: path.startsWith("api/figure") ? "default" : "no-store"}));
}
async function post(path, body = {}) {
  return answered(await fetch(path, {method: "POST", headers: {"content-type": "application/json", "x-sysid-csrf": CSRF}, body: JSON.stringify(body)}));
}
let plotly = null;
function engine() {
  plotly ??= new Promise((done, failed) => document.head.append(make("script", {src: "/plotly.js", onload: done, onerror: () => failed(new Error("plotly.js did not load"))})));
  return plotly;
}
window.sysid.figure = async id => { const [chart] = await Promise.all([get("api/figure", {sha: shown, id}), engine()]); return chart; };

// ---- what changes the experiment
async function act(path, body, wrong) {
  if (busy) return;
  busy = true;
  if (wrong) wrong.textContent = "";
  enable();
  try {
    const state = await post(path, {sha: looking, ...body});
    looking = state.sha;
    told = null;
    await follow(state);
  } catch (error) {
    if (error.status === 409) { told = "changed"; await tick(); }
    else if (wrong) wrong.textContent = error.message;
    else { told = error.message; notice(told); }
  } finally {
    busy = false;
    enable();
  }
}
function enable() {
  const state = last || {}, fresh = looking !== null && state.sha === looking && !busy && told !== "changed";
  at("undo").disabled = !(fresh && state.undo);
  at("redo").disabled = !(fresh && state.redo);
  at("undo").textContent = state.undo ? "undo " + state.undo : "undo";
  at("redo").textContent = state.redo ? "redo " + state.redo : "redo";
  for (const button of document.querySelectorAll("[data-acts]")) button.disabled = !(fresh && shown === looking && !working(state));
}
const working = state => state.job && (state.job.state === "running" || state.job.state === "cancelling");

// ---- what stands
function notice(words, ...buttons) {
  const key = words + buttons.map(b => b.textContent).join();
  if (said === key) return;
  said = key;
  at("notice").replaceChildren(...(words ? [make("p", {}, words), ...(buttons.length ? [make("div", {class: "acts"}, ...buttons)] : [])] : []));
}
const button = (words, act, more = {}) => make("button", {type: "button", onclick: act, ...more}, words);
async function follow(state) {
  last = state;
  const job = state.job, runs = working(state);
  if (looking === null && state.sha) looking = state.sha;
  const stranger = state.sha !== null && state.sha !== looking;
  if (stranger || told === "changed") notice("The experiment file changed elsewhere: in another tab or in an editor.", button("reload", () => location.reload(), {class: "first"}));
  else if (state.error) notice(state.error);
  else if (job && job.sha === looking && job.state === "failed") notice(job.error, button("try again", () => act("api/run", {})), ...(state.undo ? [button("undo " + state.undo, () => act("api/undo", {}))] : []));
  else if (job && job.sha === looking && job.state === "cancelled" && !state.ready) notice("Stopped. The experiment file holds the change; what stands below is of the text before.", button("go on", () => act("api/run", {}), {class: "first"}), ...(state.undo ? [button("undo " + state.undo, () => act("api/undo", {}))] : []));
  else if (told) notice(told);
  else if (shown === looking && shown !== null && !state.ready && !runs && !busy) notice("What was computed is not at hand any more: a log or the URDF changed, or other experiments took its memory.", button("compute again", () => act("api/run", {}), {class: "first"}));
  else notice("");
  if (shown !== null && shown === looking && runs && job.sha === looking) shown = "";  // computed again
  if (!stranger && state.ready && shown !== looking) await show(looking);
  else if (!stranger && state.fitted && !state.ready && shown !== looking && early !== looking) await showFit(looking);
  const words = runs ? (job.state === "cancelling" ? "stopping" : job.stage) : stranger || told === "changed" ? "the experiment file changed" : state.error ? "the experiment file cannot be read"
    : job && job.sha === looking && job.state === "failed" ? "failed" : state.ready ? "saved in the experiment file" : job && job.state === "cancelled" ? "stopped" : "waiting";
  if (at("status").textContent !== words) at("status").textContent = words;
  at("share").textContent = runs ? Math.round(100 * job.share) + " %" : "";
  at("progress").hidden = !runs;
  if (runs) at("progress").value = job.share;
  at("cancel").hidden = !runs;
  at("cancel").disabled = runs && job.state === "cancelling";
  const stale = shown !== null && (shown !== looking || stranger);
  at("main").classList.toggle("stale", stale);
  at("main").setAttribute("aria-busy", String(Boolean(runs)));
  at("waiting").hidden = shown !== null || early !== null || stranger || Boolean(state.error) || Boolean(job && !runs && !state.ready);
  at("report").hidden = !(shown && shown === looking);
  if (at("report").hidden === false) at("report").href = "export/report.html?sha=" + encodeURIComponent(shown);
  enable();
}
let timer = null;
async function tick() {
  clearTimeout(timer);
  let wait = 2500;
  try {
    const state = await get("api/state");
    await follow(state);
    if (working(state) || (state.ready && shown !== looking)) wait = 250;
  } catch (error) {
    if (error.status === 401) notice("The token is gone: open the address that sysid studio printed.");
    else { notice("The studio does not answer. Is it still running?"); at("status").textContent = "not connected"; at("share").textContent = ""; at("progress").hidden = at("waiting").hidden = true; }
  }
  timer = setTimeout(tick, document.hidden ? 4 * wait : wait);
}

// ---- the page
const LENT = {get, engine, make, button, number, level, stretch: (from, to) => { if (at("stretch-answer")) { at("stretch-from").value = from.toFixed(3); at("stretch-to").value = to.toFixed(3); stretch(from, to); } }};
function placed(name) {
  let section = at(name);
  if (!section) {
    section = make("section", {id: name, "aria-labelledby": name + "-title"});
    at("sections").append(section);
    at("links").append(make("li", {}, make("a", {href: "#" + name}, SHORT[name] || name)));
  }
  return section;
}
let early = null; // hash of the text whose fit is shown while it is being diagnosed
async function showFit(sha) {
  const found = await get("api/fitted", {sha});
  if (shown === sha || looking !== sha) return;
  early = sha;
  if (!at("verdict")) placed("verdict").replaceChildren(make("h2", {id: "verdict-title", tabindex: "-1"}, "Verdict"), make("p", {class: "lead"}, "The fit stands; it is being diagnosed. Its charts are below."));
  if (!at("workspace")) window.sysid.workspace.build(placed("workspace"), LENT);
  at("workspace").classList.add("fresh");
  window.sysid.workspace.show(found, sha);
  await window.sysid.workspace.all();
}
async function show(sha) {
  const found = await get("api/view", {sha});
  const focus = document.activeElement && document.activeElement.dataset ? document.activeElement.dataset.key : null, lost = at("sections").contains(document.activeElement);
  shown = sha; page = found; finding = null;
  joint = Math.min(joint, page.joints.length - 1);
  const worst = page.verdict.findIndex(v => v.status === "missing"), first = !at("look");
  if (first && worst >= 0) joint = worst;
  for (const name of page.order) {
    const section = placed(name);
    if (name === "look") { look(section); continue; }
    if (name === "workspace") {
      const workspace = window.sysid.workspace;
      if (!section.childElementCount) workspace.build(section, LENT);
      section.classList.remove("fresh");
      workspace.show(page, sha);
      if (first && worst >= 0) workspace.suggest(worst);
      workspace.all();
      continue;
    }
    const part = page.sections[name];
    section.innerHTML = part.html;  // made and escaped by the server, as in the report
    section.prepend(make("h2", {id: name + "-title", tabindex: "-1"}, part.title));
  }
  offers(); suspects(); steps();
  window.sysid.begin();
  residual();
  if (lost) { const again = focus && [...document.querySelectorAll("[data-key]")].find(e => e.dataset.key === focus); (again || at("verdict-title")).focus({preventScroll: Boolean(again)}); }
}
function offers() {
  const lead = at("verdict").querySelector(".lead");
  if (!lead || !page.offered.length) return;
  const acts = make("div", {class: "acts"});
  page.offered.slice(0, 4).forEach((offer, k) => acts.append(button("add " + on(offer.effect, offer.joint), () => act("api/add", {finding: offer.finding}), {"data-acts": true, class: k ? "" : "first", "data-key": "offer" + k})));
  if (page.offered.length > 1) acts.append(button("add all " + page.offered.length + " steps", () => act("api/add", {steps: true}), {"data-acts": true, "data-key": "offer-all"}));
  lead.after(acts);
}
function suspects() {
  for (const row of at("suspects").querySelectorAll("tr[data-finding]")) {
    const k = Number(row.dataset.finding), f = page.findings[k];
    row.querySelector("th").append(make("div", {class: "acts"},
      button("add", () => act("api/add", {finding: k}), {"data-acts": true, "aria-label": "add " + on(f.effect, f.joint), "data-key": "add" + k}),
      button("preview", event => preview(k, event.currentTarget), {"aria-pressed": "false", "aria-label": "preview what " + f.effect + " on " + (f.joint === "*" ? "the whole robot" : f.joint) + " would explain", "data-preview": k, "data-key": "preview" + k})));
  }
  anyEffect();
  const wrong = make("p", {class: "wrong", role: "alert"}), formula = make("input", {class: "code", type: "text", maxlength: 500, placeholder: "a*sin(3*q)", spellcheck: "false", autocomplete: "off", required: true});
  const where = whereabouts();
  const send = event => { event.preventDefault(); act("api/add", {formula: formula.value, joint: where.value || null}, wrong); };
  at("suspects").append(make("h3", {}, "A formula of your own"),
    make("p", {class: "quiet"}, "Torque as a formula of the joint’s motion; names that it does not know are fitted."),
    make("form", {class: "own", onsubmit: send}, make("label", {class: "wide"}, "torque = ", formula), make("label", {}, "joint", where), make("button", {type: "submit", "data-acts": true}, "add formula")), wrong);
}
function whereabouts() {
  const where = make("select", {}, ...page.joints.map(j => make("option", {value: j.name}, j.name)), make("option", {value: ""}, "every joint"));
  where.value = page.joints[joint].name;
  return where;
}
function anyEffect() {  // whatever the vocabulary has, suspect or not
  const wrong = make("p", {class: "wrong", role: "alert"}), where = whereabouts(), says = make("p", {class: "quiet", "aria-live": "polite", id: "own-says"});
  const effect = make("select", {id: "own-effect", "aria-describedby": "own-says"}, ...page.vocabulary.map(e => make("option", {value: e.effect}, e.effect)));
  const chosen = () => page.vocabulary.find(e => e.effect === effect.value);
  const whole = make("option", {value: "*"}, "whole robot");
  const told = () => {
    says.textContent = chosen().says;
    const robot = chosen().scope === "robot";
    if (robot && !whole.isConnected) { where.append(whole); where.value = "*"; }
    if (!robot && whole.isConnected) { whole.remove(); where.value = page.joints[joint].name; }
    where.disabled = robot;
  };
  effect.addEventListener("change", told);
  const send = event => { event.preventDefault(); act("api/add", {effect: effect.value, joint: chosen().scope === "robot" ? null : where.value || null}, wrong); };
  at("suspects").append(make("h3", {}, "Any other effect"),
    make("form", {class: "own", onsubmit: send}, make("label", {}, "effect", effect), make("label", {}, "joint", where), make("button", {type: "submit", "data-acts": true}, "add effect")), says, wrong);
  told();
}
function steps() {
  if (page.steps.length < 2) return;
  const options = () => page.steps.map((s, k) => make("option", {value: k}, k + ": " + s));
  const one = make("select", {}, ...options()), other = make("select", {}, ...options()), answer = make("div", {class: "answer", "aria-live": "polite"});
  one.value = String(page.steps.length - 2); other.value = String(page.steps.length - 1);
  const ask = async () => {
    try {
      const found = await get("api/compare", {from: one.value, to: other.value});
      const rows = found.joints.map(j => { const unit = (page.joints.find(p => p.name === j.joint) || {unit: ""}).unit; return make("tr", {}, make("th", {scope: "row"}, j.joint), make("td", {}, level(j.from) + " " + unit), make("td", {}, level(j.to) + " " + unit),
        make("td", {class: j.delta < 0 ? "falls" : j.delta > 0 ? "rises" : ""}, (j.delta > 0 ? "+" : "") + number(j.delta, 3) + (j.se ? " ± " + number(j.se, 2) : "") + " " + unit)); });
      answer.replaceChildren(make("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": "two steps compared"}, make("table", {}, make("thead", {}, make("tr", {}, ...["joint", "held-out RMS, first", "second", "difference"].map(w => make("th", {scope: "col"}, w)))), make("tbody", {}, ...rows))));
    } catch (error) { answer.textContent = error.message; }
  };
  one.addEventListener("change", ask); other.addEventListener("change", ask);
  at("steps").append(make("h3", {}, "Compare steps"), make("form", {class: "own", onsubmit: e => e.preventDefault()}, make("label", {}, "first", one), make("label", {}, "second", other)), answer);
  ask();
}

// ---- the residual over time: previews, and questions about a stretch of it
function look(section) {
  if (section.childElementCount) { joints(); at("stretch-answer").replaceChildren(); return; }
  const from = make("input", {type: "number", id: "stretch-from", step: "any", min: 0}), to = make("input", {type: "number", id: "stretch-to", step: "any", min: 0});
  const ask = event => { event.preventDefault(); if (from.value !== "" && to.value !== "") stretch(Number(from.value), Number(to.value)); };
  section.append(make("h2", {id: "look-title"}, "The residual, looked at closely"),
    make("p", {class: "quiet"}, "Test logs, low-passed as the diagnosis asks its questions. Drag over the chart with the mouse, or give two times, to ask what the model misses there."),
    make("div", {class: "acts", id: "look-joints", role: "group", "aria-label": "joint"}),
    make("p", {id: "look-said", class: "answer", "aria-live": "polite"}),
    make("figure", {class: "look", id: "look-figure", style: "--height:320px"}, make("div", {class: "plot"}, make("p", {class: "waiting"}, "drawing…"))),
    make("form", {class: "own", onsubmit: ask}, make("label", {}, "from [s]", from), make("label", {}, "to [s]", to), make("button", {type: "submit"}, "what is missed here?")),
    make("div", {id: "stretch-answer", class: "answer", "aria-live": "polite"}));
  joints();
}
function joints() {
  at("look-joints").replaceChildren(...page.joints.map((j, k) => button(j.name, () => { joint = k; residual(); }, {"aria-pressed": String(k === joint), "data-key": "joint" + k})));
}
function preview(k, pressed) {
  finding = finding === k ? null : k;
  const where = page.findings[k].joint, at_ = page.joints.findIndex(j => j.name === where);
  if (finding !== null && at_ >= 0) joint = at_;
  residual();
  if (finding !== null) at("look").scrollIntoView({block: "start"});
}
async function residual() {
  const own = ++asked;
  for (const b of document.querySelectorAll("[data-preview]")) b.setAttribute("aria-pressed", String(Number(b.dataset.preview) === finding));
  [...at("look-joints").children].forEach((b, k) => b.setAttribute("aria-pressed", String(k === joint)));
  try {
    const [found] = await Promise.all([get("api/residual", {sha: shown, joint, ...(finding === null ? {} : {finding})}), engine()]);
    if (own !== asked) return;
    const place = at("look-figure");
    place.setAttribute("aria-label", found.chart.label);
    const fresh = !place.querySelector(".plot").data;
    window.sysid.show(place, found.chart);
    if (fresh) place.querySelector(".plot").on("plotly_selected", event => {
      if (!event || !event.range || !event.range.x) return;
      const [a, b] = event.range.x;
      at("stretch-from").value = Math.min(a, b).toFixed(3); at("stretch-to").value = Math.max(a, b).toFixed(3);
      stretch(a, b);
    });
    at("look-said").textContent = found.joint + ": RMS " + level(found.rms) + " " + found.unit + (finding === null ? "" : "; with " + page.findings[finding].effect + " about " + level(found.explained) + " " + found.unit);
  } catch (error) { at("look-said").textContent = error.message; }
}
async function stretch(from, to) {
  const answer = at("stretch-answer");
  try {
    const found = await get("api/stretch", {sha: shown, from, to});
    if (!found.rows) { answer.textContent = "No row of the test logs lies there."; return; }
    const rows = found.joints.map(j => make("tr", {}, make("th", {scope: "row"}, j.joint), make("td", {}, level(j.here) + " " + j.unit), make("td", {}, level(j.whole) + " " + j.unit), make("td", {}, j.whole > 0 ? number(j.here / j.whole, 2) + " ×" : "–")));
    const words = found.suspects.length ? found.suspects.map(s => make("li", {}, s.effect + (s.joint === "*" ? "" : " on " + s.joint) + " would take " + Math.round(100 * s.share) + " % of the squared residual here ", button("preview", () => preview(s.finding))))
      : [make("li", {}, "None of the suspects explains what is missed here.")];
    answer.replaceChildren(make("h3", {}, "Between " + number(found.from, 4) + " and " + number(found.to, 4) + " s"), make("ul", {}, ...words),
      make("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": "residual in that stretch of time"}, make("table", {}, make("thead", {}, make("tr", {}, ...["joint", "RMS here", "RMS of all", "ratio"].map(w => make("th", {scope: "col"}, w)))), make("tbody", {}, ...rows))));
  } catch (error) { answer.textContent = error.message; }
}

at("undo").addEventListener("click", () => act("api/undo", {}));
at("redo").addEventListener("click", () => act("api/redo", {}));
at("cancel").addEventListener("click", async () => { try { await follow(await post("api/cancel")); } catch (error) { notice(error.message); } });
document.addEventListener("visibilitychange", () => { if (!document.hidden) tick(); });
(async () => {
  try { await follow(await post("api/run")); } catch (error) { if (error.status !== 422) notice(error.message); }
  tick();
})();
})();
