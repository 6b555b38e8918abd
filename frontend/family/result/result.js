// What needs a script beside the steps: saying that the network went, and sharing the sheet as a file.
const offline = document.getElementById("offline");
const share = document.getElementById("share");

const tell = () => (offline.hidden = navigator.onLine);
addEventListener("online", tell);
addEventListener("offline", tell);
tell();

const asFile = (bytes) => new File([bytes], share.dataset.name, { type: "application/pdf" });

async function shareSheet() {
  const failed = document.getElementById("share-failed");
  failed.hidden = true;
  try {
    const answer = await fetch(share.dataset.file);
    if (!answer.ok) throw new Error(String(answer.status));
    await navigator.share({ files: [asFile(await answer.blob())] });
  } catch (error) {
    failed.hidden = error.name === "AbortError"; // closed without choosing: nothing went wrong
  }
}

if (share && navigator.canShare?.({ files: [asFile("")] })) {
  share.hidden = false;
  share.addEventListener("click", shareSheet);
}
