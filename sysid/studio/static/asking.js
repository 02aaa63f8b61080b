// What the live page asks of the server, and the elements that it makes of the answers. Every text
// goes into the page as text, never as markup.
(() => {
"use strict";
const {sysid} = window;
const CSRF = document.querySelector('meta[name="sysid-csrf"]').content;

function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) {
      element.setAttribute(name, value);
    }
  }
  element.append(...children);
  return element;
}

const button = (words, act, more = {}) => make("button", {type: "button", onclick: act, ...more},
  words);

function table(label, heads, rows) { // a row: its name, then cells or elements
  const cell = value => value instanceof Element && value.tagName === "TD" ? value
    : make("td", {}, value);
  const lines = rows.map(([name, ...cells]) => make("tr", {}, make("th", {scope: "row"}, name),
    ...cells.map(cell)));
  const head = make("tr", {}, ...heads.map(word => make("th", {scope: "col"}, word)));
  return make("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": label},
    make("table", {}, make("thead", {}, head), make("tbody", {}, ...lines)));
}

const known = value => value !== null && value !== undefined && isFinite(value);
const minus = text => text.replaceAll("-", "−");
const bare = text => text.replace(/\.?0+$/, found => found.startsWith(".") ? "" : found);
const number = (value, digits = 4) => known(value)
  ? minus(bare(Number(value).toPrecision(digits))) : "–";
const level = value => known(value) ? minus(Number(value).toPrecision(4)) : "–";

function change(from, to) { // a fall or a rise in per cent
  const by = 100 * (to - from) / from;
  return (by <= 0 ? "−" : "+") + Math.abs(by).toFixed(Math.abs(by) < 10 ? 1 : 0) + " %";
}

async function answered(response) {
  let body = {};
  try {
    body = await response.json();
  } catch (error) {
    body = {error: "status " + response.status};
  }
  if (response.ok) return body;
  const said = body.error || "status " + response.status;
  throw Object.assign(new Error(said), {status: response.status});
}

async function get(path, words = {}) {
  const given = Object.entries(words).filter(([, value]) => value !== null && value !== "");
  const query = new URLSearchParams(given).toString();
  const cache = path.startsWith("api/figure") ? "default" : "no-store";
  return answered(await fetch(path + (query ? "?" + query : ""), {cache}));
}

async function post(path, body = {}) {
  const headers = {"content-type": "application/json", "x-sysid-csrf": CSRF};
  return answered(await fetch(path, {method: "POST", headers, body: JSON.stringify(body)}));
}

let plotly = null;
function engine() {
  plotly ??= new Promise((done, failed) => document.head.append(make("script", {
    src: "/plotly.js", onload: done, onerror: () => failed(new Error("plotly.js did not load")),
  })));
  return plotly;
}

sysid.page = {
  at: id => document.getElementById(id), make, button, table, number, level, change, get, post,
  engine,
};
})();
