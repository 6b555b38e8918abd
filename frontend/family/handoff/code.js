// Says when the other device has taken the case: it is not this browser's any more then.
const code = document.getElementById("code");
const moved = document.getElementById("moved");
const ASK_MS = 2000;

async function ask() {
  let status = 0;
  try {
    status = (await fetch(code.dataset.state, { headers: { Accept: "application/json" } })).status;
  } catch {
    // No network just now: the next question may get through.
  }
  if (status !== 404) {
    setTimeout(ask, ASK_MS);
    return;
  }
  code.remove();
  document.querySelector(".page-foot__case")?.remove();
  for (const link of document.querySelectorAll("a.back, .page-foot__link")) link.remove();
  moved.append(moved.querySelector("template").content);
  document.title = moved.querySelector("h1").textContent + " – Lubdub";
}

setTimeout(ask, ASK_MS);
