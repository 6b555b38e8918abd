// Sending with a progress bar, a way to stop, and drag and drop. Without script the plain form does the same.
const form = document.getElementById("scan-form");
const input = document.getElementById("scan");
const drop = document.getElementById("drop");
const sending = document.getElementById("sending");
const button = document.getElementById("send");
const problem = document.getElementById("send-problem");
const bar = document.getElementById("sent");
const words = document.getElementById("sent-words");

let request = null;

function show(isSending) {
  sending.hidden = !isSending;
  button.hidden = isSending;
}

function tell(message) {
  problem.textContent = message;
  show(false);
}

function send() {
  if (!input.files.length) {
    form.reportValidity();
    return;
  }
  problem.textContent = "";
  bar.value = 0;
  show(true);
  request = new XMLHttpRequest();
  request.open("PUT", form.dataset.put);
  request.setRequestHeader("X-CSRF-Token", form.dataset.token);
  request.setRequestHeader("Content-Type", "application/octet-stream");
  request.upload.addEventListener("progress", (event) => {
    if (!event.lengthComputable) return;
    bar.value = event.loaded / event.total;
    words.textContent = `${Math.round(100 * bar.value)} %`;
  });
  request.addEventListener("load", () => {
    if (request.status < 300) {
      window.location.assign(form.dataset.next);
      return;
    }
    let message = problem.dataset.lost;
    try {
      message = JSON.parse(request.responseText).detail ?? message;
    } catch {
      // The answer was no JSON, so not ours: the sentence about the connection is the true one.
    }
    tell(message);
  });
  request.addEventListener("error", () => tell(problem.dataset.lost));
  request.addEventListener("abort", () => show(false));
  request.send(input.files[0]);
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  send();
});
document.getElementById("cancel-sending").addEventListener("click", () => request?.abort());

for (const kind of ["dragenter", "dragover"]) {
  drop.addEventListener(kind, (event) => {
    event.preventDefault();
    drop.classList.add("drop--over");
  });
}
for (const kind of ["dragleave", "drop"]) {
  drop.addEventListener(kind, () => drop.classList.remove("drop--over"));
}
drop.addEventListener("drop", (event) => {
  event.preventDefault();
  if (event.dataTransfer.files.length) input.files = event.dataTransfer.files;
});
