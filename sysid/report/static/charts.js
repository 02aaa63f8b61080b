// Charts, drawn when they come near the window.
(() => {
"use strict";
const {sysid} = window;
const drawn = new Map(), known = new WeakSet();
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
  if (!sysid.figure) return;  // a page that is alive asks for it
  const found = sysid.figure(place.dataset.chart);
  if (!found.then) { show(place, () => found); return; }
  drawn.set(place, null);
  found.then(
    chart => { if (place.isConnected) show(place, () => chart); },
    error => { drawn.delete(place); failed(place, error); },
  );
}

function show(place, read) {
  const plot = place.querySelector(".plot");
  try {
    engine();
    const chart = read();
    drawn.set(place, chart);
    const {data, layout} = sysid.dressed(chart), settings = sysid.settings(chart);
    if (plot.data) { Plotly.react(plot, data, layout, settings); return; }
    plot.replaceChildren();
    Plotly.newPlot(plot, data, layout, settings);
    if (!place.querySelector(".take")) place.append(sysid.taken(place, () => named(place)));
    if (chart.link === "time") sysid.time.join(plot);
  } catch (error) {
    failed(place, error);
  }
}

const named = place => document.title.split(" ·")[0] + "-" + place.getAttribute("aria-label");

function failed(place, error) {
  const note = document.createElement("p");
  note.className = "waiting";
  note.textContent = "This chart could not be drawn here (" + error.message
    + "). The words and tables hold what it shows.";
  place.querySelector(".plot").replaceChildren(note);
}

// width of a chart on A4 as the style sheet lays it out, and share of its height
function sheet(place) {
  if (place.closest(".three")) return [222, 0.75];
  if (place.closest(".grid")) return [330, 0.9];
  return place.closest(".split") ? [370, 0.78] : [680, 1];
}

function redraw() {
  for (const [place, chart] of drawn) {
    const plot = place.querySelector(".plot");
    if (!chart || !plot.data) continue;
    const {data, layout} = sysid.dressed(chart);
    if (sysid.printing) {
      const [width, part] = sheet(place);
      layout.width = width;
      layout.height *= part;
    } else layout.autosize = true;
    Plotly.react(plot, data, layout, sysid.settings(chart));
  }
}

const near = new IntersectionObserver(entries => {
  for (const entry of entries) if (entry.isIntersecting) {
    near.unobserve(entry.target);
    draw(entry.target);
  }
}, {rootMargin: "300px"});

function opened(event) {
  for (const place of event.target.querySelectorAll("figure.chart")) {
    const plot = place.querySelector(".plot");
    if (plot.data) Plotly.Plots.resize(plot);
  }
}

// whatever stands in the page now; again when the page was changed
function begin() {
  for (const place of [...drawn.keys()]) if (!place.isConnected) {
    const plot = place.querySelector(".plot");
    if (plot.data) Plotly.purge(plot);
    near.unobserve(place);
    drawn.delete(place);
  }
  sysid.time.begin();
  const unknown = selector => [...document.querySelectorAll(selector)]
    .filter(e => !known.has(e) && known.add(e));
  for (const button of unknown("[data-time]")) {
    button.addEventListener("click", () => sysid.time.shift(button.dataset.time));
  }
  for (const box of unknown("details")) box.addEventListener("toggle", opened);
  for (const place of unknown("figure.chart")) {
    if (place.tabIndex === 0) place.addEventListener("keydown", sysid.time.keyed);
    near.observe(place);
  }
}

Object.assign(sysid, {
  begin, draw, redraw, show: (place, chart) => show(place, () => chart),
  chartOf: place => drawn.get(place),
});
requestAnimationFrame(() => setTimeout(begin, 0));
})();
