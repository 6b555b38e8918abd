// The picture code carries the code behind the #, which browsers do not send; it goes into the field, not into history.
const field = document.getElementById("code");
const carried = decodeURIComponent(window.location.hash.slice(1));

if (carried) {
  field.value = carried;
  history.replaceState(null, "", window.location.pathname);
}
