// Sending piece by piece: it waits out a lost network, goes on after a reload, says how far it is, and can be stopped.
// Without script the plain form does the same for small files.
const form = document.getElementById("scan-form");
const input = document.getElementById("scan");
const drop = document.getElementById("drop");
const sending = document.getElementById("sending");
const button = document.getElementById("send");
const problem = document.getElementById("send-problem");
const bar = document.getElementById("sent");
const words = document.getElementById("sent-words");
const goesOn = document.getElementById("goes-on");

const MEGABYTE = 1e6;
const PIECE = 4 * MEGABYTE;
const RETRY_DELAYS = [0, 1000, 2000, 4000, ...Array(60).fill(5000)];
const TELL_EVERY_MS = 1000;
const MARKS = "tus::lubdub-";
const OUR_MARKS = `${MARKS}${form.dataset.case}-`;

let upload = null;
let toldAt = 0;

// The beginnings of files that people choose by mistake. The service looks at the whole file again.
const BEGINNINGS = [
  ["picture", 0, [0xff, 0xd8, 0xff]],
  ["picture", 0, [0x89, 0x50, 0x4e, 0x47]],
  ["picture", 0, [0x47, 0x49, 0x46, 0x38]],
  ["picture", 8, [0x57, 0x45, 0x42, 0x50]],
  ["picture", 4, [0x66, 0x74, 0x79, 0x70, 0x68, 0x65]],
  ["picture", 4, [0x66, 0x74, 0x79, 0x70, 0x6d, 0x69, 0x66]],
  ["video", 4, [0x66, 0x74, 0x79, 0x70]],
  ["video", 0, [0x1a, 0x45, 0xdf, 0xa3]],
  ["pdf", 0, [0x25, 0x50, 0x44, 0x46]],
];

async function mistake(file) {
  if (!file.size) return "empty";
  if (file.size > Number(form.dataset.max)) return "large";
  const head = new Uint8Array(await file.slice(0, 16).arrayBuffer());
  const found = BEGINNINGS.find(([, start, bytes]) => bytes.every((byte, index) => head[start + index] === byte));
  return found ? found[0] : null;
}

function show(isSending) {
  sending.hidden = !isSending;
  button.hidden = isSending;
}

function tell(message) {
  problem.textContent = message;
  show(false);
}

function fill(sentence, facts) {
  return sentence.replace(/\{(\w+)\}/g, (_, name) => facts[name]);
}

function megabytes(bytes) {
  return (bytes / MEGABYTE).toLocaleString(document.documentElement.lang, { maximumFractionDigits: 1 });
}

function progress(since) {
  return (sent, total) => {
    bar.value = sent / total;
    const moment = performance.now();
    since.bytes ??= sent;
    if (moment - toldAt < TELL_EVERY_MS && sent < total) return;
    toldAt = moment;
    const perSecond = (1000 * (sent - since.bytes)) / (moment - since.moment);
    const seconds = perSecond > 0 ? Math.ceil((total - sent) / perSecond) : Infinity;
    const facts = { sent: megabytes(sent), total: megabytes(total), seconds, minutes: Math.ceil(seconds / 60) };
    const left = seconds > 3600 ? "sent" : seconds > 90 ? "sentMinutes" : "sentSeconds";
    words.textContent = fill(form.dataset[left], facts);
  };
}

function isWorthWaiting(error) {
  const status = error.originalResponse?.getStatus() ?? 0;
  const goesAway = status === 0 || status >= 500 || [409, 423, 429].includes(status);
  if (goesAway) words.textContent = form.dataset.waiting;
  return goesAway;
}

function failed(error) {
  let message = form.dataset.lost;
  try {
    message = JSON.parse(error.originalResponse.getBody()).detail ?? message;
  } catch {
    // No answer of ours came: the sentence about the connection is the true one.
  }
  tell(message);
}

async function send() {
  const file = input.files[0];
  if (!file) {
    form.reportValidity();
    return;
  }
  const wrong = await mistake(file);
  if (wrong) {
    tell(form.dataset[wrong]);
    return;
  }
  problem.textContent = "";
  goesOn.hidden = true;
  words.textContent = "";
  bar.value = 0;
  show(true);
  upload = new window.tus.Upload(file, {
    endpoint: form.dataset.uploads,
    chunkSize: PIECE,
    headers: { "X-CSRF-Token": form.dataset.token },
    metadata: { case: form.dataset.case },
    // No file name: nothing about a person is to stay in the browser.
    fingerprint: async () => `lubdub-${form.dataset.case}-${file.size}-${file.lastModified}`,
    removeFingerprintOnSuccess: true,
    retryDelays: RETRY_DELAYS,
    onShouldRetry: isWorthWaiting,
    onProgress: progress({ moment: performance.now() }),
    onSuccess: () => window.location.assign(form.dataset.next),
    onError: failed,
  });
  const earlier = await upload.findPreviousUploads();
  if (earlier.length) upload.resumeFromPreviousUpload(earlier[0]);
  upload.start();
}

// What tells that a part is here already. In a portal's frame a browser may keep nothing for us: then there is none.
function marks() {
  try {
    return Object.keys(localStorage).filter((mark) => mark.startsWith(MARKS));
  } catch {
    return [];
  }
}

function stop() {
  upload?.abort(true).catch(() => {
    // The service could not be told; it drops the pieces by itself after a day.
  });
  for (const mark of marks()) if (mark.startsWith(OUR_MARKS)) localStorage.removeItem(mark);
  show(false);
  input.focus();
}

form.addEventListener("submit", (event) => {
  if (!window.tus) return;
  event.preventDefault();
  send();
});
input.addEventListener("change", async () => {
  const wrong = input.files[0] && (await mistake(input.files[0]));
  problem.textContent = wrong ? form.dataset[wrong] : "";
});
document.getElementById("cancel-sending").addEventListener("click", stop);

for (const mark of marks()) {
  if (mark.startsWith(OUR_MARKS)) goesOn.hidden = false;
  else localStorage.removeItem(mark);
}

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
  if (!event.dataTransfer.files.length) return;
  input.files = event.dataTransfer.files;
  input.dispatchEvent(new Event("change"));
});
