// The worklist: j, k and the arrow keys go from case to case while one of them has the focus; when the server says that
// something changed, the list alone is asked for anew, and whoever stood on a case still stands on it.
import { follow } from "/static/lib/link.js";

const list = document.getElementById("worklist");
const told = document.getElementById("told");
const STEPS = { j: 1, k: -1, ArrowDown: 1, ArrowUp: -1 };

const links = () => [...document.querySelectorAll(".worklist-link")];

list.addEventListener("keydown", (event) => {
  const step = STEPS[event.key];
  if (!step || event.ctrlKey || event.metaKey || event.altKey) return;
  const all = links();
  const here = all.indexOf(document.activeElement);
  const next = all[Math.min(Math.max(here + step, 0), all.length - 1)];
  if (!next) return;
  event.preventDefault();
  next.focus();
});

let version = null;

async function refresh() {
  const answer = await fetch(window.location.href);
  if (!answer.ok || answer.redirected) return window.location.reload();
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  const stood = document.activeElement?.dataset?.case;
  list.innerHTML = page.getElementById("worklist").innerHTML;
  links().find((link) => link.dataset.case === stood)?.focus();
  told.textContent = told.dataset.words;
}

function heard(now) {
  if (version !== null && now.version !== version) refresh().catch(() => {});
  version = now.version;
}

follow(list.dataset.live, { heard, lost: () => {} });
if (document.activeElement === document.body) links()[0]?.focus({ preventScroll: true });
