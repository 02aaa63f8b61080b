// What stands: the experiment file, the work on it, and what was found. Every change says which
// text it was thought for.
(() => {
"use strict";
const {sysid} = window, {at, make, button, get, post} = sysid.page;
const GONE = "What was computed is not at hand any more: a log or the URDF changed, "
  + "or other experiments took its memory.";
const STOPPED = "Stopped. The experiment file holds the change; what stands below is of the text "
  + "before.";
// looking: hash of the experiment file that this page is about; shown: that of the results in it
const stands = {looking: null, shown: null, early: null, last: null};
let busy = false, said = "", told = null;

async function act(path, body, wrong) { // what changes the experiment
  if (busy) return null;
  busy = true;
  if (wrong) wrong.textContent = "";
  enable();
  try {
    const state = await post(path, {sha: stands.looking, ...body});
    stands.looking = state.sha;
    told = null;
    await follow(state);
    return state;
  } catch (error) {
    if (error.status === 409) {
      told = "changed";
      await tick();
    } else if (wrong) wrong.textContent = error.message;
    else {
      told = error.message;
      notice(told);
    }
    return null;
  } finally {
    busy = false;
    enable();
    tick();
  }
}

const runs = job => Boolean(job) && (job.state === "running" || job.state === "cancelling");
const working = state => runs(state.job);

function enable() {
  const state = stands.last || {}, {looking, shown, early} = stands;
  const fresh = looking !== null && state.sha === looking && !busy && told !== "changed";
  for (const word of ["undo", "redo"]) {
    at(word).disabled = !(fresh && state[word]);
    at(word).textContent = state[word] ? word + " " + state[word] : word;
  }
  for (const one of document.querySelectorAll("[data-acts]")) {
    one.disabled = !(fresh && shown === looking && !working(state));
  }
  for (const one of document.querySelectorAll("[data-looks]")) { // beside a diagnosis, too
    one.disabled = !(fresh && (shown === looking || early === looking));
  }
}

function notice(words, ...buttons) {
  const key = words + buttons.map(one => one.textContent).join();
  if (said === key) return;
  said = key;
  const acts = buttons.length ? [make("div", {class: "acts"}, ...buttons)] : [];
  at("notice").replaceChildren(...(words ? [make("p", {}, words), ...acts] : []));
}

function noticed(state, stranger) {
  const {looking, shown} = stands, {job} = state, mine = job && job.sha === looking;
  const again = words => button(words, () => act("api/run", {}), {class: "first"});
  const undo = state.undo ? [button("undo " + state.undo, () => act("api/undo", {}))] : [];
  if (stranger || told === "changed") {
    notice("The experiment file changed elsewhere: in another tab or in an editor.",
      button("reload", () => location.reload(), {class: "first"}));
  } else if (state.error) notice(state.error);
  else if (mine && job.state === "failed") notice(job.error, again("try again"), ...undo);
  else if (mine && job.state === "cancelled" && !state.ready) {
    notice(STOPPED, again("go on"), ...undo);
  } else if (told) notice(told);
  else if (shown === looking && shown !== null && !state.ready && !working(state) && !busy) {
    notice(GONE, again("compute again"));
  } else notice("");
}

function bar(state, stranger) {
  const {job, aside} = state, one = working(state) ? job : runs(aside) ? aside : null;
  const mine = job && job.sha === stands.looking;
  const prefix = one === aside && one ? aside.said + ": " : "";
  const words = one ? prefix + (one.state === "cancelling" ? "stopping" : one.stage)
    : stranger || told === "changed" ? "the experiment file changed"
    : state.error ? "the experiment file cannot be read"
    : mine && job.state === "failed" ? "failed"
    : state.ready ? "saved in the experiment file"
    : job && job.state === "cancelled" ? "stopped" : "waiting";
  if (at("status").textContent !== words) at("status").textContent = words;
  at("share").textContent = one ? Math.round(100 * one.share) + " %" : "";
  at("progress").hidden = at("cancel").hidden = !one;
  if (one) at("progress").value = one.share;
  at("cancel").disabled = Boolean(one) && one.state === "cancelling";
}

async function follow(state) {
  stands.last = state;
  const {job} = state, first = working(state);
  if (stands.looking === null && state.sha) stands.looking = state.sha;
  const {looking} = stands, stranger = state.sha !== null && state.sha !== looking;
  noticed(state, stranger);
  if (stands.shown !== null && stands.shown === looking && first && job.sha === looking) {
    stands.shown = ""; // computed again
  }
  if (!stranger && state.ready && stands.shown !== looking) await sysid.sections.show(looking);
  else if (!stranger && state.fitted && !state.ready && stands.shown !== looking
    && stands.early !== looking) await sysid.sections.showFit(looking);
  bar(state, stranger);
  const {shown, early} = stands;
  at("main").classList.toggle("stale", shown !== null && (shown !== looking || stranger));
  at("main").setAttribute("aria-busy", String(first));
  at("waiting").hidden = shown !== null || early !== null || stranger || Boolean(state.error)
    || Boolean(job && !first && !state.ready);
  at("report").hidden = !(shown && shown === looking);
  if (!at("report").hidden) {
    at("report").href = "export/report.html?sha=" + encodeURIComponent(shown);
  }
  if (first) sysid.sections.soFar(job.found);
  sysid.remedies.follow(state);
  enable();
}

let timer = null;
async function tick() {
  clearTimeout(timer);
  let wait = 2500;
  try {
    const state = await get("api/state");
    await follow(state);
    const soon = state.ready && stands.shown !== stands.looking;
    if (working(state) || runs(state.aside) || soon) wait = 250;
  } catch (error) {
    if (error.status === 401) {
      notice("The token is gone: open the address that sysid studio printed.");
    } else {
      notice("The studio does not answer. Is it still running?");
      at("status").textContent = "not connected";
      at("share").textContent = "";
      at("progress").hidden = at("waiting").hidden = true;
    }
  }
  clearTimeout(timer);
  timer = setTimeout(tick, document.hidden ? 4 * wait : wait);
}

function begin() {
  at("undo").addEventListener("click", () => act("api/undo", {}));
  at("redo").addEventListener("click", () => act("api/redo", {}));
  at("cancel").addEventListener("click", async () => {
    try {
      await follow(await post("api/cancel"));
    } catch (error) {
      notice(error.message);
    }
  });
  document.addEventListener("visibilitychange", () => { if (!document.hidden) tick(); });
  (async () => {
    try {
      await follow(await post("api/run"));
    } catch (error) {
      if (error.status !== 422) notice(error.message);
    }
    tick();
  })();
}
sysid.standing = {stands, act, enable, begin, tick, runs};
})();
