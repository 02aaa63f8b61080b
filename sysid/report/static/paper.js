// On paper: every list open and every chart drawn, light, at the width of the sheet.
(() => {
"use strict";
const {sysid} = window;
let closed = [];
addEventListener("beforeprint", () => {
  sysid.printing = true;
  closed = [...document.querySelectorAll("details:not([open])")];
  for (const box of closed) box.open = true;
  for (const place of document.querySelectorAll("figure.chart")) sysid.draw(place);
  sysid.redraw();
});
addEventListener("afterprint", () => {
  sysid.printing = false;
  for (const box of closed) box.open = false;
  sysid.redraw();
});
})();
