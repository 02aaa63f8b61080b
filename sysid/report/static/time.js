// One time axis: every chart over time shows the same stretch.
(() => {
"use strict";
const {sysid} = window;
const KEYS = {
  ArrowLeft: "back", ArrowRight: "on", "+": "in", "=": "in", "-": "out", "0": "all",
};
const plots = new Set();
let range = null, whole = null, moving = false;

const timed = () => [...plots].filter(plot => plot.isConnected && plot._fullLayout);

function follow(but) {
  moving = true;
  const wanted = () => ({"xaxis.range": [...(range || whole)]});
  const all = timed().filter(plot => plot !== but).map(plot => Plotly.relayout(plot, wanted()));
  Promise.all(all).finally(() => { moving = false; });
}

// a plot that is drawn joins the others
function join(plot) {
  if (!whole && plot._fullLayout) whole = [...plot._fullLayout.xaxis.range];
  plots.add(plot);
  plot.on("plotly_relayout", change => {
    if (moving || sysid.printing) return;
    const [low, high] = [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    if (low !== undefined) range = [low, high];
    else if (Array.isArray(change["xaxis.range"])) range = [...change["xaxis.range"]];
    else if (change["xaxis.autorange"]) range = null;
    else return;
    follow(plot);
  });
}

function shift(what) {
  if (!whole) {
    const first = document.querySelector('figure.chart[data-chart^="torque"]');
    if (first) sysid.draw(first);
  }
  if (!whole) return;
  range = stepped(what, range || whole, whole);
  follow(null);
}

// what is in sight after a step, null for the whole
function stepped(what, [a, b], whole) {
  const width = b - a, middle = (a + b) / 2, by = (what === "on" ? 1 : -1) * width / 2;
  if (what === "all") return null;
  if (what === "in") return [middle - width / 4, middle + width / 4];
  if (what !== "out") return [a + by, b + by];
  return width * 2 >= whole[1] - whole[0] ? null : [middle - width, middle + width];
}

function keyed(event) {
  if (!KEYS[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  shift(KEYS[event.key]);
}

sysid.time = {
  KEYS, join, shift, stepped, keyed,
  placed(layout) { if (range) layout.xaxis.range = [...range]; },
  begin() {  // the page was changed
    for (const plot of plots) if (!plot.isConnected) plots.delete(plot);
    if (!timed().length) whole = null;
  },
};
})();
