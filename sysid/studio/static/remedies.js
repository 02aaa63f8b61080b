// What can be done about what is missing: a suspect, any effect with its options, a formula, each
// previewed or added; a stretch of time masked; a motion designed.
(() => {
"use strict";
const {sysid} = window, {at, make, button, get, post} = sysid.page;
const {stands, act, tick, runs} = sysid.standing;
let page = null;
let wanted = null; // hash of the preview that is being made, to be shown when it is there
let forms = null; // made once: what was typed stays when the diagnosis comes

// ---- previews: the very fit that the change gives
async function preview(body, wrong) {
  if (wrong) wrong.textContent = "";
  try {
    const state = await post("api/preview", {sha: stands.looking, ...body});
    wanted = {sha: state.preview, joint: body.joint || null};
    follow(state);
    tick();
  } catch (error) {
    if (wrong) wrong.textContent = error.message;
    else at("notice").replaceChildren(make("p", {}, error.message));
  }
}

function follow(state) {
  if (!page || ![stands.shown, stands.early].includes(state.sha)) return;
  sysid.workspace.previews(state.previews);
  const {aside} = state, failed = aside && aside.state === "failed";
  if (wanted && state.previews.some(one => one.sha === wanted.sha)) {
    sysid.workspace.previewed(wanted.sha, page.joints.findIndex(j => j.name === wanted.joint));
    wanted = null;
  } else if (wanted && aside && aside.sha === wanted.sha && !runs(aside)) wanted = null;
  at("aside").textContent = failed ? aside.said + ": " + aside.error : "";
  for (const one of document.querySelectorAll("[data-designs]")) designed(one, state);
}

// ---- suspects
function suspects() {
  for (const row of at("suspects").querySelectorAll("tr[data-finding]")) {
    const k = Number(row.dataset.finding), {effect, joint} = page.findings[k];
    const where = joint === "*" ? "the whole robot" : joint, wrong = failure();
    const body = {finding: k, joint};
    row.querySelector("th").append(make("div", {class: "acts"},
      button("add", () => act("api/add", {finding: k}), {
        "data-acts": true, "aria-label": "add " + sysid.sections.on(effect, joint),
        "data-key": "add" + k,
      }),
      button("preview", () => preview(body, wrong), {
        "data-acts": true, "data-key": "preview" + k,
        "aria-label": "preview what " + effect + " on " + where + " would explain",
      })), wrong);
  }
}

function tries() { // what may be what is left of a joint
  for (const place of at("verdict").querySelectorAll("[data-tries]")) {
    const {effect, joint, options} = JSON.parse(place.dataset.tries), wrong = failure();
    const text = Object.entries(options).map(([name, value]) => [name, String(value)]);
    const body = {effect, joint, options: Object.fromEntries(text)};
    const named = {"data-acts": true, "data-key": "try-" + effect + "-" + joint};
    place.append(make("div", {class: "acts"},
      button("preview " + effect, () => preview(body, wrong), named),
      button("add " + effect, () => act("api/add", body, wrong),
        {...named, "data-key": named["data-key"] + "-add"})), wrong);
  }
}

const failure = () => make("p", {class: "wrong", role: "alert"});

function whereabouts() {
  const where = make("select", {class: "where"}, ...page.joints.map(j => make("option",
    {value: j.name}, j.name)), make("option", {value: ""}, "every joint"));
  where.addEventListener("change", () => { where.dataset.chosen = "by hand"; });
  return where;
}

const inSight = () => page.joints[sysid.workspace.view.joint].name;

function suggested() { // the joint in sight, where nobody chose another
  for (const one of at("suspects").querySelectorAll("select.where")) {
    if (!one.dataset.chosen && !one.disabled) one.value = inSight();
  }
}

function form(id, fields, body, word) { // fields, and a button to preview and one to add
  const wrong = failure();
  const send = event => {
    event.preventDefault();
    act("api/add", body(), wrong);
  };
  const before = button("preview", () => preview(body(), wrong),
    {"data-looks": true, id: id + "-preview", "data-key": id + "-preview"});
  const add = make("button", {type: "submit", "data-acts": true, "data-key": id}, word);
  return [make("form", {class: "own", id, onsubmit: send}, ...fields, add, before), wrong];
}

function anyEffect() { // whatever the vocabulary has, suspect or not
  const where = whereabouts(), says = make("p", {class: "quiet", "aria-live": "polite",
    id: "own-says"});
  const effect = make("select", {id: "own-effect", "aria-describedby": "own-says"},
    ...page.vocabulary.map(e => make("option", {value: e.effect}, e.effect)));
  const options = make("div", {class: "options"}), inputs = {};
  const chosen = () => page.vocabulary.find(e => e.effect === effect.value);
  const whole = make("option", {value: "*"}, "whole robot");
  const told = () => {
    const {says: words, scope, options: own} = chosen(), robot = scope === "robot";
    says.textContent = words;
    if (robot && !whole.isConnected) {
      where.append(whole);
      where.value = "*";
    } else if (!robot && whole.isConnected) {
      whole.remove();
      where.value = inSight();
    }
    where.disabled = robot;
    for (const name of Object.keys(inputs)) delete inputs[name];
    options.replaceChildren(...own.map(({name, says: meant}) => {
      inputs[name] = make("input", {class: "code", type: "text", maxlength: 200,
        autocomplete: "off", spellcheck: "false"});
      return make("label", {class: "wide"}, name + ": " + meant, inputs[name]);
    }));
  };
  effect.addEventListener("change", told);
  const body = () => ({
    effect: effect.value, joint: chosen().scope === "robot" ? null : where.value || null,
    options: Object.fromEntries(Object.entries(inputs).map(([name, box]) => [name, box.value])),
  });
  const fields = [make("label", {}, "effect", effect), make("label", {}, "joint", where), options];
  told();
  return [make("h3", {}, "Any other effect"), ...form("own", fields, body, "add effect"), says];
}

function formula() {
  const box = make("input", {class: "code", id: "own-formula", type: "text", maxlength: 500,
    placeholder: "a*sin(3*q)", spellcheck: "false", autocomplete: "off", required: true});
  const where = whereabouts();
  const fields = [make("label", {class: "wide"}, "torque = ", box), make("label", {}, "joint",
    where)];
  const body = () => ({formula: box.value, joint: where.value || null});
  return [make("h3", {}, "A formula of your own"), make("p", {class: "quiet"},
    "Torque as a formula of the joint’s motion; names that it does not know are fitted."),
    ...form("formula", fields, body, "add formula")];
}

// ---- a motion that separates what is tied, or that tells most
function designs() {
  const tied = [...at("verdict").querySelectorAll("[data-separate]")];
  for (const place of tied) place.after(offered(place.dataset.separate.split(",")));
  for (const card of at("verdict").querySelectorAll(".card.blind")) {
    if (!card.querySelector("[data-designs]")) card.append(offered(null));
  }
}

function offered(separate) {
  const key = "design" + (separate || ["most"]).join(), said = make("p", {class: "quiet"});
  const ask = async () => {
    try {
      const state = await post("api/design", {sha: stands.looking, separate});
      said.dataset.designs = state.design;
      said.textContent = "designing a motion; the bar below says how far it is";
      tick();
    } catch (error) {
      said.textContent = error.message;
    }
  };
  said.dataset.designs = separate ? separate.map(one => one.replace(":", "-").replace("*", "robot"))
    .join("-against-").replace(/[^\w.-]+/g, "_").slice(0, 100) : "informative";
  return make("span", {class: "design"}, button(separate ? "design a motion that separates them"
    : "design the next motion", ask, {"data-acts": true, "data-key": key}), said);
}

function designed(place, state) { // the design that was asked for here, where it is there
  const own = state.designs.find(one => one.name === place.dataset.designs), {aside} = state;
  const mine = aside && aside.sha === "design " + place.dataset.designs;
  if (mine && aside.state === "failed") place.textContent = aside.error;
  if (!own || (mine && runs(aside)) || place.dataset.told === own.says) return;
  place.dataset.told = own.says;
  const link = file => make("a", {download: true, href: "export/design?"
    + new URLSearchParams({name: own.name, file})}, file);
  place.replaceChildren(own.says + ": ", link("trajectory.csv"), ", ", link("trajectory.yaml"),
    ", ", link("design.json"), ". Log it, and give the log to data.train.");
}

function build(found) { // of a fit, or of its diagnosis
  page = found;
  forms ??= make("div", {class: "on-screen"}, ...anyEffect(), ...formula());
  if (found.findings) {
    suspects();
    tries();
  }
  at("suspects").append(forms);
  suggested();
  if (found.findings) designs();
  get("api/state").then(follow, () => {});
}

sysid.remedies = {build, follow, preview, designs, tries};
})();
