"""The look of the page: one style sheet, light and dark, on a desk, on a phone and on paper."""

STYLE = """
:root { --paper:#ffffff; --raised:#f6f7f8; --ink:#16191d; --quiet:#5a636e; --line:#d9dde2; --grid:#e6e9ed; --accent:#0072B2;
  --good:#007a59; --bad:#b84e00; --odd:#a2457f; --bar:#0072B2; --bar-ground:#e8ebee; color-scheme: light; }
@media (prefers-color-scheme: dark) { :root { --paper:#14171a; --raised:#1c2025; --ink:#e4e7ea; --quiet:#9aa4af; --line:#353b42;
  --grid:#2a3037; --accent:#56B4E9; --good:#35c79d; --bad:#f59350; --odd:#e39cc4; --bar:#56B4E9; --bar-ground:#2a3037; color-scheme: dark; } }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; scroll-behavior: smooth; scroll-padding-top: 3rem; }
@media (prefers-reduced-motion: reduce) { html { scroll-behavior: auto; } }
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", "DejaVu Sans", sans-serif; }
header.top, main, footer { max-width: 72rem; margin: 0 auto; padding: 0 1rem; }
header.top { padding-top: 1.5rem; }
h1 { font-size: 1.5rem; line-height: 1.25; margin: 0; overflow-wrap: anywhere; }
h2 { font-size: 1.25rem; margin: 0 0 .6rem; }
h3 { font-size: 1rem; margin: 1.2rem 0 .4rem; overflow-wrap: anywhere; }
p, ul { margin: .4rem 0 .8rem; max-width: 62rem; overflow-wrap: anywhere; }
ul { padding-left: 1.2rem; }
a { color: var(--accent); }
:focus-visible { outline: 2px solid var(--accent); outline-offset: 2px; }
.quiet, .empty, h3 .quiet, summary .quiet { color: var(--quiet); font-weight: normal; font-size: .9rem; }
.empty { border-left: 3px solid var(--line); padding-left: .8rem; font-size: 1rem; }
.skip { position: absolute; left: -999rem; } .skip:focus { left: 1rem; top: .5rem; background: var(--paper); padding: .3rem .6rem; z-index: 3; }
.only-read { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); white-space: nowrap; }
nav { position: sticky; top: 0; z-index: 2; background: var(--paper); border-bottom: 1px solid var(--line); margin: .8rem 0 0; }
nav ul { max-width: 72rem; margin: 0 auto; padding: .5rem 1rem; list-style: none; display: flex; gap: 1.1rem; overflow-x: auto; white-space: nowrap; }
nav a { text-decoration: none; font-size: .9rem; color: var(--quiet); } nav a:hover { color: var(--accent); }
section { padding: 1.6rem 0 1.2rem; border-bottom: 1px solid var(--line); }
.lead { font-size: 1.15rem; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 20rem), 1fr)); gap: .8rem; }
.card { border: 1px solid var(--line); border-left: 5px solid var(--tone); border-radius: 4px; padding: .6rem .9rem; background: var(--raised); min-width: 0; }
.card h3 { margin: 0 0 .3rem; } .card p { margin: .2rem 0; font-size: .95rem; } .card .numbers { color: var(--quiet); font-size: .85rem; font-variant-numeric: tabular-nums; }
.card.complete { --tone: var(--good); } .card.missing { --tone: var(--bad); } .card.unknown { --tone: var(--odd); }
.card.explained { --tone: var(--accent); } .card.unresolved { --tone: var(--quiet); } .by-hand { overflow-x: auto; } .by-hand code { white-space: nowrap; } .card pre { padding: .35rem .6rem; margin: .3rem 0; background: var(--paper); }
.sizes th, .sizes td { text-align: left; }
.mark { display: inline-block; width: 1.4em; height: 1.4em; line-height: 1.4em; text-align: center; border-radius: 50%; color: var(--paper); background: var(--tone); margin-right: .4rem; font-size: .85em; }
.status { color: var(--tone); font-weight: 600; font-size: .85rem; margin-left: .3rem; }
.scroll { overflow-x: auto; max-width: 100%; margin: .4rem 0 .8rem; }
table { border-collapse: collapse; font-size: .875rem; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .3rem .8rem .3rem 0; border-bottom: 1px solid var(--line); vertical-align: top; white-space: nowrap; }
thead th { color: var(--quiet); font-weight: 600; vertical-align: bottom; white-space: normal; }
th:first-child, td:first-child { text-align: left; } tbody th { font-weight: 600; }
table.wrap td { white-space: normal; text-align: left; min-width: 7rem; } table.wrap th { text-align: left; }
code, pre { font: .82rem/1.45 ui-monospace, SFMono-Regular, Menlo, Consolas, "DejaVu Sans Mono", monospace; }
pre { background: var(--raised); border: 1px solid var(--line); border-radius: 4px; padding: .7rem .9rem; overflow-x: auto; }
details { border-top: 1px solid var(--line); padding: .3rem 0; } details:last-of-type { border-bottom: 1px solid var(--line); } section > details:last-child { border-bottom: 0; padding-bottom: 0; }
summary { cursor: pointer; padding: .35rem 0; font-weight: 600; overflow-wrap: anywhere; }
.grid { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 21rem), 1fr)); gap: .6rem 1rem; }
.grid.three { grid-template-columns: repeat(auto-fit, minmax(min(100%, 19rem), 1fr)); }
.split { display: grid; grid-template-columns: minmax(0, auto) minmax(0, 1fr); gap: 1rem; align-items: start; }
figure { margin: .3rem 0; min-width: 0; } figcaption { color: var(--quiet); font-size: .85rem; }
.plot { min-height: var(--height); width: 100%; overflow: hidden; }
.waiting { color: var(--quiet); font-size: .85rem; padding: 1rem; margin: 0; }
.tools { display: flex; flex-wrap: wrap; gap: .4rem; margin: .4rem 0; position: sticky; top: 2.5rem; z-index: 1; background: var(--paper); padding: .4rem 0; }
button { font: inherit; font-size: .85rem; color: var(--ink); background: var(--raised); border: 1px solid var(--line); border-radius: 4px; padding: .25rem .7rem; min-height: 2rem; cursor: pointer; }
button:hover { border-color: var(--accent); }
.suspects th[scope=row] { min-width: 9rem; white-space: normal; } .suspects small { display: block; font-weight: normal; color: var(--quiet); max-width: 19rem; white-space: normal; }
.key { white-space: nowrap; margin-right: 1.2rem; } .key i { display: inline-block; width: 1.8rem; height: .55rem; margin-right: .4rem; border-bottom: 2px solid var(--bar); vertical-align: .15rem; }
.key .broken { border-bottom-style: dashed; } .key .floor { border-bottom: 2px dotted var(--good); background: color-mix(in srgb, var(--good) 22%, transparent); }
.suspects td:nth-of-type(1), .suspects thead th:nth-child(2) { text-align: left; } .suspects td:nth-of-type(2), .suspects thead th:nth-child(3) { text-align: left; }
.suspects td:nth-of-type(3), .suspects thead th:nth-child(4) { text-align: left; }
.suspects .value { margin-left: .5rem; } .bar { width: 9rem; height: 14px; vertical-align: -2px; }
.bar .ground { fill: var(--bar-ground); } .bar .fill { fill: var(--bar); } .bar .whisker { stroke: var(--ink); stroke-width: 1.5; fill: none; vector-effect: non-scaling-stroke; }
.suspects .family th { border-bottom: 0; color: var(--quiet); font-weight: normal; font-size: .82rem; padding-top: .8rem; white-space: normal; }
.suspects .family span { position: sticky; left: 0; display: inline-block; max-width: min(100%, 90vw); }
.suspects tbody tr > *:first-child { padding-left: .7rem; }
.suspects tbody.tied tr:not(.family) > *:first-child { border-left: 3px solid var(--bad); }
.meter { display: inline-block; width: 3rem; height: .5rem; margin-right: .5rem; background: linear-gradient(90deg, var(--bar) var(--share), var(--bar-ground) var(--share)); }
footer { color: var(--quiet); font-size: .85rem; padding-top: 1rem; padding-bottom: 2rem; }
@media (max-width: 56rem) { .split { grid-template-columns: minmax(0, 1fr); } }
@media (max-width: 40rem) { body { font-size: 15px; } header.top, main, footer { padding-left: .75rem; padding-right: .75rem; } .bar { width: 5.5rem; } table { font-size: .8rem; } th, td { padding-right: .45rem; }
  .scroll table:not(.suspects) th:first-child { position: sticky; left: 0; background: var(--paper); }
  tbody th { white-space: normal; max-width: 10rem; } .suspects tbody th { max-width: none; } .steps tbody th { min-width: 7.5rem; }
  .parameters { font-size: .73rem; } .parameters .meter { display: none; } .parameters th, .parameters td { padding-right: .28rem; } .parameters .quiet { font-size: inherit; }
  .bodies td, .bodies th { white-space: normal; padding-right: .3rem; } .bodies { font-size: .72rem; } .logs td { white-space: normal; } .logs code { overflow-wrap: anywhere; display: block; min-width: 7rem; }
  table.wrap th, table.wrap td { white-space: normal; min-width: 3.2rem; overflow-wrap: normal; } .key { white-space: normal; display: block; }
  .suspects, .suspects tbody, .suspects tr:not(.family) { display: block; width: 100%; } .suspects thead { position: absolute; clip-path: inset(50%); width: 1px; height: 1px; overflow: hidden; }
  .suspects tbody tr.family, .suspects tbody tr.family th { display: block; } .suspects tr:not(.family) { padding: .4rem 0 .4rem .7rem; border-bottom: 1px solid var(--line); }
  .suspects tr:not(.family) > * { display: block; border: 0 !important; padding: .05rem 0 !important; text-align: left; white-space: normal; }
  .suspects tr:not(.family) td[data-label] { display: inline-block; margin-right: 1rem; color: var(--quiet); font-size: .82rem; } .suspects td[data-label]::before { content: attr(data-label) " "; }
  .suspects .bar { width: 11rem; } .suspects small { max-width: none; } .suspects tbody.tied tr:not(.family) { border-left: 3px solid var(--bad); } }
@media print {
  :root { --paper:#fff; --raised:#fff; --ink:#000; --quiet:#444; --line:#bbb; --grid:#ddd; --accent:#0072B2; --good:#007a59; --bad:#b84e00; --odd:#a2457f; --bar:#0072B2; --bar-ground:#e4e4e4; color-scheme: light; }
  @page { size: A4; margin: 14mm; }
  body { font-size: 10pt; print-color-adjust: exact; -webkit-print-color-adjust: exact; } nav, .tools, .skip, .modebar { display: none !important; }
  header.top, main, footer { max-width: none; padding: 0; } section { break-inside: auto; border: 0; padding: .8rem 0; }
  h2, h3, summary, #failures ul, #failures p { break-after: avoid; } figure, .card, tr, pre { break-inside: avoid; } .scroll { overflow: visible; }
  table { font-size: 8pt; } th, td { white-space: normal; padding-right: .5rem; } td code { overflow-wrap: anywhere; } pre { white-space: pre-wrap; overflow-wrap: anywhere; }
  .grid { grid-template-columns: 330px 330px; } .grid.three { grid-template-columns: repeat(3, 222px); gap: 4px; } .grid.three .plot { break-inside: avoid; } .split { grid-template-columns: minmax(0, 1fr) 370px; break-inside: avoid; } .bar { width: 6rem; }
  .plot { min-height: 0; } .split table { font-size: 7pt; } .split .meter { width: 1.5rem; }
}
"""
