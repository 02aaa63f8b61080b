"""What the live page has beside the report's look: buttons that act, the bar with the work, the skeleton."""

STYLE = """
body { padding-bottom: 4.5rem; }
#bar { position: fixed; left: 0; right: 0; bottom: 0; z-index: 4; display: flex; flex-wrap: wrap; gap: .4rem 1rem; align-items: center; justify-content: space-between;
  padding: .5rem max(1rem, calc((100vw - 70rem) / 2)); background: var(--raised); border-top: 1px solid var(--line); }
#bar .work { flex: 1 1 14rem; min-width: 0; font-size: .9rem; font-variant-numeric: tabular-nums; } #bar .buttons { display: flex; flex-wrap: wrap; gap: .4rem; }
#bar progress { display: block; width: 100%; max-width: 30rem; height: .5rem; margin-top: .25rem; accent-color: var(--bar); }
#bar progress[hidden] { display: none; }
#share { color: var(--quiet); }
button, a.button { background: var(--paper); }
a.button { display: inline-flex; align-items: center; font-size: .85rem; color: var(--ink); border: 1px solid var(--line); border-radius: 4px; padding: .25rem .7rem; min-height: 2rem; text-decoration: none; }
a.button[hidden] { display: none; } a.button:hover { border-color: var(--accent); }
button:disabled { color: var(--quiet); opacity: .6; cursor: default; border-color: var(--line); }
button.first { background: var(--bar); border-color: var(--bar); color: var(--paper); font-weight: 600; }
button[aria-pressed=true] { border-color: var(--accent); box-shadow: inset 0 0 0 1px var(--accent); }
.acts { display: flex; flex-wrap: wrap; gap: .4rem; margin: .5rem 0; align-items: center; } .acts button { white-space: normal; text-align: left; overflow-wrap: anywhere; }
.by-hand { display: none; }
.suspects th .acts { margin: .35rem 0 .2rem; font-weight: normal; }
#notice:empty { display: none; } #notice { margin-top: 1rem; border: 1px solid var(--line); border-left: 5px solid var(--bad); border-radius: 4px; background: var(--raised); padding: .6rem .9rem; overflow-wrap: anywhere; }
#notice p { margin: 0 0 .3rem; }
#waiting { padding-top: 1rem; } #waiting[hidden] { display: none; }
.bone { background: var(--raised); border-radius: 4px; margin: 0 0 1rem; animation: breathe 1.6s ease-in-out infinite alternate; }
@keyframes breathe { from { opacity: 1; } to { opacity: .45; } }
@media (prefers-reduced-motion: reduce) { .bone { animation: none; } }
main.stale #sections { opacity: .75; }
form.own { display: flex; flex-wrap: wrap; gap: .5rem; align-items: end; margin: .5rem 0; } form.own label { display: flex; flex-direction: column; font-size: .82rem; color: var(--quiet); min-width: 0; }
form.own label.wide { flex: 1 1 16rem; max-width: 32rem; }
input, select { font: inherit; font-size: .9rem; color: var(--ink); background: var(--paper); border: 1px solid var(--line); border-radius: 4px; padding: .2rem .5rem; min-height: 2rem; max-width: 100%; }
input[type=number] { width: 7rem; } input.code { font-family: ui-monospace, SFMono-Regular, Menlo, Consolas, "DejaVu Sans Mono", monospace; width: 100%; }
.wrong { color: var(--bad); margin: .2rem 0; overflow-wrap: anywhere; } .wrong:empty { display: none; }
input.moment { flex: 1 1 12rem; max-width: 30rem; padding: 0; accent-color: var(--bar); }
h2[tabindex="-1"]:focus { outline: none; } .experiments { border: 0 !important; font-size: .9rem; } .experiments summary { font-weight: normal; padding: .2rem 0; } .experiments ul { display: flex; flex-wrap: wrap; gap: .2rem 1.2rem; list-style: none; padding: 0; margin: .2rem 0; } .experiments [aria-current] { color: var(--ink); font-weight: 600; text-decoration: none; }
.answer { min-height: 1.5rem; } .falls { color: var(--good); } .rises { color: var(--bad); }
#notice > :last-child { margin-bottom: 0; }
@media (max-width: 40rem) { body { padding-bottom: 7.5rem; } #redo:disabled { display: none; } #bar { padding: .45rem .75rem; } .suspects th .acts button { flex: 1 1 auto; text-align: center; } .answer td { white-space: normal; } }
@media print { #bar, .experiments, .acts, form.own, #notice { display: none; } body { padding: 0; } }
"""
