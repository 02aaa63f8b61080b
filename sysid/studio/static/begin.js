// Everything stands: begin.
window.sysid.standing.begin();
