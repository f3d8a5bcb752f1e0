// Requests of the page to the server. A refusal is an error with the server's message.

async function ask(method, path, body) {
  let response;
  try {
    response = await fetch(path, body === undefined ? { method } : { method, headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
  } catch {
    throw Object.assign(new Error("The studio does not answer. Is `teachtree studio` still running?"), { gone: true });
  }
  const answer = await response.json();
  if (!response.ok) throw Object.assign(new Error(answer.error), { status: response.status, answer });
  return answer;
}

export const get = (path) => ask("GET", path);
export const put = (path, body) => ask("PUT", path, body);
export const post = (path, body) => ask("POST", path, body);

/** Shows a sentence at a place; one that is wrong in the color of errors, a report with its lines. */
export function say(place, text = "", isWrong = false) {
  place.textContent = text;
  place.classList.toggle("wrong", isWrong);
  place.classList.toggle("report", text.includes("\n"));
}

const message = document.getElementById("message");

/** Shows a sentence above the recording; nothing takes it away. */
export function tell(text = "") {
  say(message, text, true);
  message.hidden = !text;
}
