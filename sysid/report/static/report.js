// What makes the page move: charts drawn when they come into view, one time axis for all joints, light, dark and paper.
(() => {
"use strict";
const DARK = {"#000000":"#e4e7ea", "#0072b2":"#56b4e9", "#d55e00":"#f59350", "#009e73":"#35c79d", "#999999":"#6f7882", "#e69f00":"#f0b429", "#cc79a7":"#e39cc4",
  "#56b4e9":"#3d86b0", "#fdfdfd":"#101315", "#dcdcdc":"#3c434b"};
const darkness = matchMedia("(prefers-color-scheme: dark)"), coarse = matchMedia("(pointer: coarse)");
let places = [];
const drawn = new Map(), known = new WeakSet();
let printing = false, range = null, whole = null;

function turned(value) {
  if (typeof value === "string") return DARK[value.toLowerCase()] || value;
  if (Array.isArray(value)) return typeof value[0] === "number" && typeof value[1] !== "string" ? value : value.map(turned);
  if (value && typeof value === "object") return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, turned(v)]));
  return value;
}
function dressed(chart) {
  const dark = darkness.matches && !printing;
  const css = getComputedStyle(document.documentElement), get = name => css.getPropertyValue(name).trim();
  const ink = printing ? "#000000" : get("--ink"), grid = printing ? "#dddddd" : get("--grid"), line = printing ? "#bbbbbb" : get("--line");
  const figure = dark ? turned(chart.figure) : structuredClone(chart.figure), layout = figure.layout;
  layout.paper_bgcolor = "rgba(0,0,0,0)";
  if (!layout.plot_bgcolor) layout.plot_bgcolor = "rgba(0,0,0,0)";
  layout.font = {...layout.font, color: ink, family: getComputedStyle(document.body).fontFamily || "sans-serif"};
  layout.hoverlabel = {bgcolor: printing ? "#ffffff" : get("--raised"), bordercolor: line, font: {color: ink}};
  layout.modebar = {bgcolor: "rgba(0,0,0,0)", color: get("--quiet"), activecolor: get("--accent")};
  const axes = Object.keys(layout).filter(k => /^[xy]axis\d*$/.test(k)).map(k => layout[k]);
  for (const axis of axes) Object.assign(axis, {gridcolor: grid, linecolor: line, zerolinecolor: line, color: ink});
  if (layout.scene) for (const k of ["xaxis", "yaxis", "zaxis"]) Object.assign(layout.scene[k], {gridcolor: line, zerolinecolor: line, color: ink, showbackground: false});
  if (coarse.matches && !layout.scene) layout.dragmode = false;  // a finger scrolls the page
  if (layout.legend && !layout.scene && innerWidth < 600) layout.legend.font = {...layout.legend.font, size: 10};  // in one row
  if (layout.scene && innerWidth < 600) for (const k of "xyz") layout.scene.camera.eye[k] *= layout.scene.aspectratio.z < 1 ? 1.6 : 1.2;  // the whole width in sight
  if (chart.link === "time" && range) layout.xaxis.range = [...range];
  return figure;
}
const CONFIG = {displaylogo: false, responsive: true, showTips: false, plotlyServerURL: "", doubleClick: "reset",
  modeBarButtonsToRemove: ["lasso2d", "select2d", "autoScale2d", "toImage", "sendChartToCloud", "sendDataToCloud", "resetCameraLastSave3d", "zoom2d", "pan2d"]};
const settings = chart => ({...CONFIG, displayModeBar: coarse.matches && !chart.figure.layout.scene ? false : "hover"});
let loaded = false;
function engine() {
  if (loaded || window.Plotly) return;
  const script = document.createElement("script");
  script.textContent = document.getElementById("plotly").textContent;
  document.head.append(script);
  loaded = true;
}
function draw(place) {
  if (drawn.has(place)) return;
  const source = document.getElementById("figure-" + place.dataset.chart);
  if (source) { show(place, () => JSON.parse(source.textContent)); return; }
  if (!window.sysid.figure) return;  // a page that is alive asks for it
  drawn.set(place, null);
  window.sysid.figure(place.dataset.chart).then(chart => { if (place.isConnected) show(place, () => chart); }, error => { drawn.delete(place); failed(place, error); });
}
function show(place, read) {
  const plot = place.querySelector(".plot");
  try {
    engine();
    const chart = read();
    drawn.set(place, chart);
    const figure = dressed(chart);
    if (plot.data) { Plotly.react(plot, figure.data, figure.layout, settings(chart)); return; }
    plot.replaceChildren();
    Plotly.newPlot(plot, figure.data, figure.layout, settings(chart));
    if (chart.link === "time") linked(plot);
  } catch (error) {
    failed(place, error);
  }
}
function failed(place, error) {
  const note = document.createElement("p");
  note.className = "waiting";
  note.textContent = "This chart could not be drawn here (" + error.message + "). The words and tables hold what it shows.";
  place.querySelector(".plot").replaceChildren(note);
}
function redraw() {
  for (const [place, chart] of drawn) {
    const plot = place.querySelector(".plot");
    if (!chart || !plot.data) continue;
    const figure = dressed(chart);
    if (printing) {  // as the style sheet lays out A4
      const [width, part] = place.closest(".three") ? [222, 0.75] : place.closest(".grid") ? [330, 0.9] : place.closest(".split") ? [370, 0.78] : [680, 1];
      figure.layout.width = width; figure.layout.height *= part;
    }
    else figure.layout.autosize = true;
    Plotly.react(plot, figure.data, figure.layout, settings(chart));
  }
}
// ---- one time axis
const timed = () => [...drawn].filter(([, chart]) => chart && chart.link === "time").map(([place]) => place.querySelector(".plot")).filter(p => p._fullLayout);
let moving = false;
function linked(plot) {
  if (!whole && plot._fullLayout) whole = [...plot._fullLayout.xaxis.range];
  plot.on("plotly_relayout", change => {
    if (moving || printing) return;
    if (change["xaxis.range[0]"] !== undefined) range = [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    else if (Array.isArray(change["xaxis.range"])) range = [...change["xaxis.range"]];
    else if (change["xaxis.autorange"]) range = null;
    else return;
    follow(plot);
  });
}
function follow(but) {
  moving = true;
  const all = timed().filter(p => p !== but).map(p => Plotly.relayout(p, {"xaxis.range": [...(range || whole)]}));
  Promise.all(all).finally(() => { moving = false; });
}
function shift(what) {
  if (!whole) { const first = places.find(p => /^torque/.test(p.dataset.chart)); if (first) draw(first); }
  if (!whole) return;
  const [a, b] = range || whole, width = b - a, middle = (a + b) / 2;
  if (what === "all") range = null;
  else if (what === "in") range = [middle - width / 4, middle + width / 4];
  else if (what === "out") range = width * 2 >= whole[1] - whole[0] ? null : [middle - width, middle + width];
  else { const by = (what === "on" ? 1 : -1) * width / 2; range = [a + by, b + by]; }
  follow(null);
}
const KEYS = {ArrowLeft: "back", ArrowRight: "on", "+": "in", "=": "in", "-": "out", "0": "all"};
function keyed(event) {
  if (!KEYS[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  shift(KEYS[event.key]);
}
// ---- drawn when they come near
const near = new IntersectionObserver(entries => {
  for (const entry of entries) if (entry.isIntersecting) { near.unobserve(entry.target); draw(entry.target); }
}, {rootMargin: "300px"});
const opened = event => {
  for (const place of event.target.querySelectorAll("figure.chart")) { const plot = place.querySelector(".plot"); if (plot.data) Plotly.Plots.resize(plot); }
};
function begin() {  // whatever stands in the page now; again when the page was changed
  for (const place of [...drawn.keys()]) if (!place.isConnected) { const plot = place.querySelector(".plot"); if (plot.data) Plotly.purge(plot); near.unobserve(place); drawn.delete(place); }
  if (!timed().length) whole = null;
  places = [...document.querySelectorAll("figure.chart")];
  const unknown = selector => [...document.querySelectorAll(selector)].filter(e => !known.has(e) && known.add(e));
  for (const button of unknown("[data-time]")) button.addEventListener("click", () => shift(button.dataset.time));
  for (const box of unknown("details")) box.addEventListener("toggle", opened);
  for (const place of unknown("figure.chart")) { if (place.tabIndex === 0) place.addEventListener("keydown", keyed); near.observe(place); }
}
window.sysid = {begin, show: (place, chart) => show(place, () => chart), figure: null};
requestAnimationFrame(() => setTimeout(begin, 0));
darkness.addEventListener("change", redraw);
// ---- paper: everything drawn, light, at the width of the sheet
let closed = [];
addEventListener("beforeprint", () => {
  printing = true;
  closed = [...document.querySelectorAll("details:not([open])")];
  for (const box of closed) box.open = true;
  for (const place of places) draw(place);
  redraw();
});
addEventListener("afterprint", () => {
  printing = false;
  for (const box of closed) box.open = false;
  redraw();
});
})();
