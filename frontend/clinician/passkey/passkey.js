// Buttons that make or use a passkey: <button data-passkey="create|get" data-at="/desk/..."> asks for the options at
// `<at>/options`, lets the browser do its part, and hands the result in at `<at>`. Fields of its form go along.
const token = document.body.dataset.token;
const fault = document.getElementById("passkey-fault");
const isNumber = /^[\d.]+$|:/.test(window.location.hostname);
const works = window.PublicKeyCredential?.parseRequestOptionsFromJSON && !isNumber;

async function send(path, body) {
  const headers = { Accept: "application/json", "Content-Type": "application/json", "X-CSRF-Token": token };
  const answer = await fetch(path, { method: "POST", headers, body: JSON.stringify(body) });
  const told = await answer.json();
  if (told.type === "/problems/sign-in-again") {
    window.location.assign(`/desk/sign-in?${new URLSearchParams({ again: 1, back: window.location.pathname })}`);
    return null;
  }
  if (!answer.ok) throw new Error(Object.values(told.errors ?? {}).filter((one) => typeof one === "string").join(" "));
  return told;
}

async function run(button) {
  const fields = button.form ? Object.fromEntries(new FormData(button.form)) : {};
  const options = await send(`${button.dataset.at}/options`, fields);
  if (options === null) return;
  const credential =
    button.dataset.passkey === "create"
      ? await navigator.credentials.create({ publicKey: PublicKeyCredential.parseCreationOptionsFromJSON(options) })
      : await navigator.credentials.get({ publicKey: PublicKeyCredential.parseRequestOptionsFromJSON(options) });
  const told = await send(button.dataset.at, { ...fields, credential: credential.toJSON() });
  if (told !== null) window.location.assign(told.next);
}

for (const button of document.querySelectorAll("[data-passkey]")) {
  button.closest(".passkey").hidden = !works;
  button.addEventListener("click", async () => {
    fault.hidden = true;
    button.disabled = true;
    try {
      await run(button);
    } catch (error) {
      fault.textContent = (error.name === "Error" && error.message) || fault.dataset.words;
      fault.hidden = false;
      button.disabled = false;
    }
  });
}
