// The points page: buttons answer without a reload, the server's stream says what was tapped, the crosshair
// serves those who cannot tap. The words all come from the server; this file only swaps them in.
const marking = document.getElementById("marking");
const pieces = ["ask", "actions", "list"].map((name) => [name, document.getElementById(name)]);
const view = document.getElementById("view");
const waiting = document.getElementById("frame-waiting");
const lost = document.getElementById("frame-lost");
const cross = document.getElementById("frame-cross");
const crossToggle = document.getElementById("cross-toggle");
const crossForm = document.getElementById("cross-form");

let version = -1;
let wasConnected = false;

function swap(said) {
  const hadFocus = pieces.some(([, piece]) => piece.contains(document.activeElement));
  for (const [name, piece] of pieces) piece.innerHTML = said[name];
  version = said.version;
  if (hadFocus) document.querySelector("#actions button")?.focus({ preventScroll: true });
}

async function refresh() {
  const answer = await fetch(marking.dataset.panel, { headers: { Accept: "application/json" } });
  if (answer.ok) swap(await answer.json());
}

async function send(form, submitter) {
  const answer = await fetch(form.getAttribute("action"), {
    method: "POST",
    headers: { Accept: "application/json" },
    body: new FormData(form, submitter),
  });
  const said = await answer.json();
  if (said.next) window.location.assign(said.next);
  else if (answer.ok) swap(said);
  else document.getElementById("ask-state").textContent = said.detail ?? said.message;
}

document.addEventListener("submit", (event) => {
  const form = event.target;
  if (!form.closest("#marking")) return;
  event.preventDefault();
  send(form, event.submitter).catch(() => form.submit());
});

// A lost link leaves the last picture standing, which looks alive: say so, and load the view again.
function showAgain() {
  view.src = view.getAttribute("src");
}

let reload = null;

function connection(isConnected) {
  waiting.hidden = isConnected || wasConnected;
  lost.hidden = isConnected || !wasConnected;
  if (isConnected) {
    clearInterval(reload);
    reload = null;
  } else if (wasConnected) {
    reload ??= setInterval(showAgain, 6000);
  }
  wasConnected ||= isConnected;
}

const stream = new EventSource(marking.dataset.live);
stream.addEventListener("marks", (event) => {
  const said = JSON.parse(event.data);
  connection(said.connected);
  if (said.version !== version) refresh().catch(() => {});
});
document.getElementById("frame-again").addEventListener("click", showAgain);

crossToggle.addEventListener("click", () => {
  const isOn = crossForm.hidden;
  cross.toggleAttribute("hidden", !isOn);
  crossForm.hidden = !isOn;
  crossToggle.setAttribute("aria-pressed", String(isOn));
  if (isOn) view.focus();
});
