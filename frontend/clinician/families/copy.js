// One press puts the text where it can be pasted from.
const text = document.getElementById("text");
const copy = document.getElementById("copy");

copy.hidden = !navigator.clipboard;
copy.addEventListener("click", async () => {
  await navigator.clipboard.writeText(text.value);
  copy.textContent = copy.dataset.done;
});
