// The points page: buttons answer without a reload, the server's stream says what was tapped, the crosshair
// serves those who cannot tap. The words all come from the server; this file only swaps them in.
import { follow } from "/static/lib/link.js";
import { connection, cut } from "/static/lib/lost_view.js";

const marking = document.getElementById("marking");
const pieces = ["ask", "actions", "list"].map((name) => [name, document.getElementById(name)]);
const said = document.getElementById("said");
const cross = document.getElementById("frame-cross");
const crossToggle = document.getElementById("cross-toggle");
const crossForm = document.getElementById("cross-form");
const crossPlace = document.getElementById("cross-place");

let version = -1;

document.getElementById("tools").hidden = false; // without this script there is no crosshair

function swap(now) {
  const pressed = pieces.some(([, piece]) => piece.contains(document.activeElement));
  for (const [name, piece] of pieces) piece.innerHTML = now[name];
  version = now.version;
  if (pressed) document.querySelector("#actions button")?.focus({ preventScroll: true });
  const heading = document.querySelector("#ask h1").textContent;
  const words = [...document.querySelectorAll(".ask__odd p, .ask__state")].map((one) => one.textContent);
  said.textContent = [heading, ...words].join(" ");
}

async function refresh() {
  const answer = await fetch(marking.dataset.panel, { headers: { Accept: "application/json" } });
  if (answer.ok) swap(await answer.json());
  else if (answer.status < 500) window.location.reload(); // the case has gone on elsewhere: the server knows where
}

function complain(words) {
  const state = document.getElementById("ask-state");
  state.textContent = words;
  said.textContent = words;
}

async function send(form, submitter) {
  const answer = await fetch(form.getAttribute("action"), {
    method: "POST",
    headers: { Accept: "application/json" },
    body: new FormData(form, submitter),
  });
  const now = await answer.json();
  if (now.next) window.location.assign(now.next);
  else if (answer.ok) swap(now);
  else complain(now.detail ?? now.message);
}

document.addEventListener("submit", (event) => {
  const form = event.target;
  if (!form.closest("#marking")) return;
  event.preventDefault();
  send(form, event.submitter).catch(() => complain(marking.dataset.failed));
});

function heard(now) {
  connection(now.connected);
  if (now.version !== version) refresh().catch(() => {});
}

function lost() {
  cut();
  if (navigator.onLine) refresh().catch(() => {});
}

function canDraw() {
  return Boolean(document.createElement("canvas").getContext("webgl2"));
}

if (canDraw()) {
  follow(marking.dataset.live, { heard, lost });
} else {
  document.getElementById("no-webgl").hidden = false;
  for (const name of ["frame", "tools"]) document.getElementById(name).hidden = true;
}

crossToggle.addEventListener("click", () => {
  const isOn = crossForm.hidden;
  cross.toggleAttribute("hidden", !isOn);
  crossForm.hidden = !isOn;
  document.getElementById("tap-hint").hidden = isOn;
  document.getElementById("cross-hint").hidden = !isOn;
  crossToggle.setAttribute("aria-pressed", String(isOn));
  if (isOn) crossPlace.focus({ preventScroll: true });
});

// Arrow keys slide the crosshair over the body; what is pressed while an answer is on its way is sent together.
const STEPS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
let right = 0;
let up = 0;
let isSliding = false;

async function slide() {
  isSliding = true;
  while (right !== 0 || up !== 0) {
    const form = new FormData(crossForm);
    form.set("action", "slide");
    form.set("right", right);
    form.set("up", up);
    right = 0;
    up = 0;
    const headers = { Accept: "application/json" };
    const answer = await fetch(crossForm.getAttribute("action"), { method: "POST", headers, body: form });
    if (!answer.ok) complain((await answer.json()).detail);
  }
  isSliding = false;
}

crossPlace.addEventListener("keydown", (event) => {
  const step = STEPS[event.key];
  if (!step) return;
  event.preventDefault();
  right += step[0];
  up += step[1];
  if (!isSliding) slide().catch(() => { isSliding = false; complain(marking.dataset.failed); });
});
