// Charts in the page's colours: light, dark and on paper.
(() => {
"use strict";
const sysid = window.sysid = {printing: false, figure: null};
const DARK = {
  "#000000": "#e4e7ea", "#0072b2": "#56b4e9", "#d55e00": "#f59350", "#009e73": "#35c79d",
  "#999999": "#6f7882", "#e69f00": "#f0b429", "#cc79a7": "#e39cc4", "#56b4e9": "#3d86b0",
  "#fdfdfd": "#101315", "#dcdcdc": "#3c434b",
};
const CONFIG = {
  displaylogo: false, responsive: true, showTips: false, plotlyServerURL: "", doubleClick: "reset",
  modeBarButtonsToRemove: [
    "lasso2d", "select2d", "autoScale2d", "toImage", "sendChartToCloud", "sendDataToCloud",
    "resetCameraLastSave3d", "zoom2d", "pan2d",
  ],
};
const darkness = matchMedia("(prefers-color-scheme: dark)");
const coarse = matchMedia("(pointer: coarse)");
const CLEAR = "rgba(0,0,0,0)", NARROW = 600; // px

function turned(value) {
  if (typeof value === "string") return DARK[value.toLowerCase()] || value;
  if (Array.isArray(value)) {
    return typeof value[0] === "number" && typeof value[1] !== "string" ? value : value.map(turned);
  }
  if (value && typeof value === "object") {
    return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, turned(v)]));
  }
  return value;
}

// the figure of a chart as the page shows it now
sysid.dressed = chart => {
  const {printing} = sysid, dark = darkness.matches && !printing;
  const css = getComputedStyle(document.documentElement);
  const get = name => css.getPropertyValue(name).trim();
  const ink = printing ? "#000000" : get("--ink"), grid = printing ? "#dddddd" : get("--grid");
  const line = printing ? "#bbbbbb" : get("--line");
  const figure = dark ? turned(chart.figure) : structuredClone(chart.figure), {layout} = figure;
  layout.paper_bgcolor = CLEAR;
  if (!layout.plot_bgcolor) layout.plot_bgcolor = CLEAR;
  const family = getComputedStyle(document.body).fontFamily || "sans-serif";
  layout.font = {...layout.font, color: ink, family};
  layout.hoverlabel = {
    bgcolor: printing ? "#ffffff" : get("--raised"), bordercolor: line, font: {color: ink},
  };
  layout.modebar = {bgcolor: CLEAR, color: get("--quiet"), activecolor: get("--accent")};
  for (const trace of figure.data) {  // nothing stands in a second box beside a hover text
    if (!trace.hovertemplate || trace.hovertemplate.includes("<extra>")) continue;
    trace.hovertemplate = trace.hovertemplate.replaceAll("\n", "<br>") + "<extra></extra>";
  }
  const axes = Object.keys(layout).filter(k => /^[xy]axis\d*$/.test(k)).map(k => layout[k]);
  for (const axis of axes) {
    Object.assign(axis, {gridcolor: grid, linecolor: line, zerolinecolor: line, color: ink});
  }
  if (layout.scene) for (const k of ["xaxis", "yaxis", "zaxis"]) {
    const colours = {gridcolor: line, zerolinecolor: line, color: ink, showbackground: false};
    Object.assign(layout.scene[k], colours);
  }
  if (coarse.matches && !layout.scene) layout.dragmode = false;  // a finger scrolls the page
  if (innerWidth < NARROW) {
    // in one row
    if (layout.legend && !layout.scene) layout.legend.font = {...layout.legend.font, size: 10};
    if (layout.scene) for (const k of "xyz") {  // the whole width in sight
      layout.scene.camera.eye[k] *= layout.scene.aspectratio.z < 1 ? 1.6 : 1.2;
    }
  }
  if (chart.link === "time") sysid.time.placed(layout);
  return figure;
};
sysid.settings = chart => {
  const still = coarse.matches && !chart.figure.layout.scene;
  return {...CONFIG, displayModeBar: still ? false : "hover"};
};
darkness.addEventListener("change", () => sysid.redraw());
})();
