// A lost link leaves the last picture standing, which looks alive: say so, and load the view again. For pages with a
// live frame.
import { pause } from "/static/lib/link.js";

const FIRST_MS = 60000; // a slow phone may take this long to draw the first picture

const view = document.getElementById("view");
const waiting = document.getElementById("frame-waiting");
const lost = document.getElementById("frame-lost");

let isShown = false;
let isStale = false;
let reloads = 0;
let again = null;

function forgetPlan() {
  clearTimeout(again);
  again = null;
}

function showAgain() {
  forgetPlan();
  isStale = false;
  reloads += 1;
  view.src = view.getAttribute("src");
}

// The server's stream says whether this window's picture is connected.
export function connection(isConnected) {
  if (isConnected && isStale) showAgain();
  else if (isConnected) {
    forgetPlan();
    reloads = 0;
    isShown = true;
  } else {
    again ??= setTimeout(showAgain, isShown || reloads > 0 ? 2 * pause(reloads) : FIRST_MS);
  }
  waiting.hidden = isConnected || isShown;
  lost.hidden = isConnected || !isShown;
}

// The stream itself was cut: nobody can say how the picture is.
export function cut() {
  isStale = isShown;
  forgetPlan();
  lost.hidden = !isShown;
}

document.getElementById("frame-again").addEventListener("click", showAgain);
