// Rule files in an editor: typed text runs over the open recording at once, with findings, hover and completion of the language server.

import { escaped, showTracks } from "./bench.js";
import { current, onOpen, open } from "./recording.js";
import { get, post, put, tell } from "./server.js";
import { takeParams } from "./tune.js";

const byId = (id) => document.getElementById(id);
const place = byId("editor"), choice = byId("editor-file"), area = byId("editor-text"), numbers = byId("editor-numbers"), sheet = byId("sheet");
const list = byId("findings"), status = byId("editor-state"), about = byId("editor-about"), popup = byId("proposals"), conflict = byId("editor-conflict");

/** The files on the server, the changed texts, and their findings. */
const rules = { files: [], version: 0, texts: {}, findings: [], theirs: undefined };
/** Whether texts were changed since they were sent, and whether the last ones did not run. */
let unsent = false, refused = false;
let asking = false, again = false, later, aboutLater;

const plain = (text) => text.replaceAll("\r\n", "\n");
const chosen = () => rules.files.find((file) => file.name === choice.value);
const textOf = (file) => rules.texts[file.name] ?? file.base;
const changed = () => Object.keys(rules.texts).length > 0;
const isError = (one) => one.severity === "error";
const isSound = () => !rules.findings.some(isError);
/** Whether texts have errors that are only here; errors of the files are in the files. */
const isHeld = () => changed() && !isSound();

// ---- drawing

function options() {
  const value = choice.value;
  choice.innerHTML = rules.files.map(({ name, own }) => `<option value="${escaped(name)}">${escaped(name)}${name in rules.texts ? " (changed)" : own ? "" : " (comes with the program)"}</option>`).join("");
  choice.value = rules.files.some((file) => file.name === value) ? value : (rules.files.find((file) => file.own) || rules.files[0])?.name ?? "";
}

function marks() {
  const worst = new Map();
  for (const one of rules.findings) if (one.file === choice.value && worst.get(one.line) !== "error") worst.set(one.line, one.severity);
  const count = area.value.split("\n").length;
  numbers.innerHTML = Array.from({ length: count }, (_, at) => `<span${worst.has(at + 1) ? ` class="${worst.get(at + 1)}"` : ""}>${at + 1}</span>`).join("\n");
  numbers.scrollTop = area.scrollTop;
}

function drawFindings() {
  list.innerHTML = rules.findings.map((one, at) => {
    const where = one.file ? `${one.file}:${one.line}:${one.column}` : "";
    const more = [one.about, ...one.notes, ...one.help.map((help) => `help: ${help}`)].filter(Boolean).map((text) => `<span class="quiet">${escaped(text)}</span>`).join("");
    return `<li><button type="button" data-finding="${at}"><b class="${one.severity}">${one.severity} ${one.code}</b> <span class="quiet">${escaped(where)}</span> <span>${escaped(one.message)}</span>${more}</button></li>`;
  }).join("");
  marks();
}

function bar() {
  byId("write-rules").disabled = !changed() || !isSound() || refused || asking || Boolean(rules.theirs);
  byId("discard-rules").disabled = !changed();
  const file = chosen();
  area.readOnly = !file?.own;
  byId("editor-shipped").hidden = !file || file.own;
  if (file) byId("editor-shipped").textContent = `${file.name} comes with the program: \`teachtree show ${file.name.split("/").pop()} > ${file.name.split("/").pop()}\` makes a copy of your own; name it with --rules.`;
}

/** Shows the chosen file from its beginning, or as it is with new findings. */
function showFile() {
  const file = chosen();
  area.value = file ? plain(textOf(file)) : "";
  area.scrollTop = 0;
  closePopup();
  drawFindings();
  bar();
}

function take({ version, files, findings }) {
  Object.assign(rules, { version, files, findings, theirs: undefined });
  rules.texts = Object.fromEntries(files.filter((file) => plain(file.text) !== plain(file.base)).map((file) => [file.name, file.text]));
  conflict.hidden = true;
  const before = choice.value, text = area.value;
  options();
  if (!isSound()) showErrors();
  if (before !== choice.value || !chosen() || plain(textOf(chosen())) !== text) showFile();
  else { drawFindings(); bar(); }
}

/** Rule files that do not run are shown with the first error. */
function showErrors() {
  const { file } = rules.findings.find((one) => isError(one) && one.file) ?? {};
  place.open = true;
  if (file) choice.value = file;
  tellErrors();
}

function tellErrors() {
  const errors = rules.findings.filter(isError).length;
  const lanes = current.answer?.failed ? "lanes are shown after they are fixed" : "the lanes are those of the last text without";
  status.textContent = `${errors} error${errors > 1 ? "s" : ""}: ${lanes}`;
}

/** Adds files that the present texts use and the previous ones did not; changes in a file stay. */
function takeFiles(more) {
  const names = more.map((file) => file.name);
  rules.files = [...rules.files.filter((file) => !file.isNew || names.includes(file.name)), ...more.filter(({ name }) => !rules.files.some((file) => file.name === name)).map((file) => ({ ...file, isNew: true }))];
  const before = choice.value;
  options();
  if (before !== choice.value) showFile();
}

async function read() {
  const at = current.at;
  try {
    const answer = await get(`api/recording/${at}/rules`);
    // What is typed meanwhile, or was sent since, is not replaced by an answer from before.
    if (current.at === at && !asking && !unsent && answer.version >= rules.version) take(answer);
  } catch (error) {
    status.textContent = error.message;
  }
}

// ---- changing

area.addEventListener("input", () => {
  const file = chosen();
  if (!file) return;
  if (area.value === plain(file.base)) delete rules.texts[file.name]; else rules.texts[file.name] = area.value;
  options();
  marks();
  unsent = true;
  bar();
  clearTimeout(later);
  later = setTimeout(run, 120);
});

/** Runs the texts of now; while they run, the last ones wait. */
async function run() {
  if (rules.theirs) return;
  if (asking) { again = true; return; }
  asking = true;
  unsent = refused = false;
  clearTimeout(later);
  bar();
  const at = current.at, began = performance.now();
  try {
    const answer = await put(`api/recording/${at}/rules`, { version: rules.version, files: rules.texts });
    Object.assign(rules, { version: answer.version, findings: answer.findings });
    takeFiles(answer.more);
    if (answer.lanes && current.at === at) {
      showTracks(answer.lanes.tracks, answer.lanes.colors);
      takeParams(answer.params);
    }
    if (isSound()) status.textContent = answer.refused ?? `analyzed in ${Math.round(performance.now() - began)} ms`;
    else tellErrors();
    refused = Boolean(answer.refused);
    if (answer.lanes) tell();
  } catch (error) {
    refused = true;
    if (error.status === 409) {
      rules.theirs = error.answer;
      conflict.hidden = false;
      conflict.querySelector("button").focus();
    } else {
      status.textContent = error.message;
    }
  }
  asking = false;
  drawFindings();
  bar();
  if (again) { again = false; return run(); }
  // What was typed in the meantime runs when its pause is over.
  if (unsent) return;
  clearTimeout(later);
  // Explanations and shades follow when the hand rests.
  later = setTimeout(() => { if (current.at === at && isSound() && !refused && !unsent) open(at); }, 900);
}

byId("take-rules").addEventListener("click", () => {
  rules.theirs = undefined;
  conflict.hidden = true;
  // What was typed here is given up.
  unsent = false;
  clearTimeout(later);
  read();
});
byId("keep-rules").addEventListener("click", () => {
  rules.version = rules.theirs.version;
  rules.theirs = undefined;
  conflict.hidden = true;
  run();
});

choice.addEventListener("change", showFile);
byId("discard-rules").addEventListener("click", () => {
  rules.texts = {};
  options();
  showFile();
  run();
});
byId("write-rules").addEventListener("click", async () => {
  if (unsent) await run();
  clearTimeout(later);
  if (!isSound() || refused) return;
  try {
    const { files } = await post(`api/recording/${current.at}/params/save`, {});
    await open(current.at);
    status.textContent = `written: ${files.join(", ")}`;
  } catch (error) {
    status.textContent = error.message;
  }
});

/** The list contains the version of the texts: changes of another window are shown. */
export function followRules(version) {
  if (version !== rules.version && rules.files.length && !asking && !unsent && !rules.theirs && !isHeld()) read();
}

// ---- findings

list.addEventListener("click", (event) => {
  const one = rules.findings[event.target.closest("[data-finding]")?.dataset.finding];
  if (!one?.file) return;
  if (choice.value !== one.file) { choice.value = one.file; showFile(); }
  const lines = area.value.split("\n"), column = [...(lines[one.line - 1] ?? "")].slice(0, one.column - 1).join("").length;
  const at = lines.slice(0, one.line - 1).reduce((sum, line) => sum + line.length + 1, 0) + column;
  area.focus();
  area.setSelectionRange(at, at);
  area.scrollTop = Math.max(0, (one.line - 5) * lineHeight());
});
area.addEventListener("scroll", () => { numbers.scrollTop = area.scrollTop; closePopup(); });

// ---- hover, at the caret and under the pointer

const lineHeight = () => parseFloat(getComputedStyle(area).lineHeight);
const ruler = document.createElement("canvas").getContext("2d");
function letterWidth() {
  const style = getComputedStyle(area);
  ruler.font = `${style.fontSize} ${style.fontFamily}`;
  return ruler.measureText("0").width;
}

function caret(offset = area.selectionStart) {
  const before = area.value.slice(0, offset).split("\n");
  return { line: before.length - 1, character: before[before.length - 1].length };
}

async function tellAbout({ line, character }) {
  if (!chosen()) return;
  const file = choice.value;
  const { text } = await post(`api/recording/${current.at}/rules/hover`, { files: rules.texts, file, line, character }).catch(() => ({}));
  if (file === choice.value) about.innerHTML = text ? marked(text) : "";
}

/** The Markdown that the language server writes: code in fences and between backticks, paragraphs. */
function marked(text) {
  const inline = (part) => escaped(part).replace(/\\([*_<[\]#]|&lt;)/g, "$1").replace(/`([^`]+)`/g, "<code>$1</code>");
  return text.split(/```(?:teachtree)?\n([\s\S]*?)\n```/).map((part, at) => at % 2 ? `<pre>${escaped(part)}</pre>` : part.split("\n\n").filter((one) => one.trim()).map((one) => `<p>${inline(one.trim())}</p>`).join("")).join("");
}

document.addEventListener("selectionchange", () => {
  if (document.activeElement !== area) return;
  clearTimeout(aboutLater);
  aboutLater = setTimeout(() => tellAbout(caret()), 350);
});
area.addEventListener("pointermove", (event) => {
  clearTimeout(aboutLater);
  const box = area.getBoundingClientRect(), style = getComputedStyle(area);
  const line = Math.floor((event.clientY - box.top + area.scrollTop - parseFloat(style.paddingTop)) / lineHeight());
  const character = Math.floor((event.clientX - box.left + area.scrollLeft - parseFloat(style.paddingLeft)) / letterWidth());
  if (line < 0 || character < 0 || character > (area.value.split("\n")[line] ?? "").length) return;
  aboutLater = setTimeout(() => tellAbout({ line, character }), 350);
});

// ---- completion

let proposals = [], picked = 0;

function closePopup() {
  proposals = [];
  popup.hidden = true;
  area.removeAttribute("aria-activedescendant");
}

function drawPopup() {
  popup.innerHTML = proposals.map((one, at) => `<li role="option" id="proposal-${at}" data-proposal="${at}" aria-selected="${at === picked}"><b>${escaped(one.label)}</b> <span class="quiet">${escaped(one.detail)}</span></li>`).join("");
  popup.hidden = !proposals.length;
  if (!proposals.length) return;
  area.setAttribute("aria-activedescendant", `proposal-${picked}`);
  popup.children[picked].scrollIntoView({ block: "nearest" });
}

async function propose() {
  if (area.readOnly) return;
  const offset = area.selectionStart, file = choice.value, { line, character } = caret(offset);
  const answer = await post(`api/recording/${current.at}/rules/complete`, { files: rules.texts, file, line, character }).catch(() => ({ proposals: [] }));
  if (area.selectionStart !== offset || choice.value !== file || document.activeElement !== area) return;
  proposals = answer.proposals;
  picked = 0;
  if (!proposals.length) status.textContent = "nothing is known that fits here";
  drawPopup();
  if (popup.hidden) return;
  const left = area.offsetLeft + character * letterWidth() - area.scrollLeft;
  popup.style.top = `${(line + 1) * lineHeight() - area.scrollTop + 8}px`;
  popup.style.left = `${Math.max(0, Math.min(left, sheet.clientWidth - popup.offsetWidth - 4))}px`;
}

function insert(one) {
  const at = area.selectionStart;
  closePopup();
  area.focus();
  area.setSelectionRange(at - one.replaces, at);
  // So that the browser can undo it.
  if (!document.execCommand("insertText", false, one.label)) {
    area.setRangeText(one.label, at - one.replaces, at, "end");
    area.dispatchEvent(new Event("input"));
  }
}

area.addEventListener("keydown", (event) => {
  if (event.ctrlKey && event.key === " ") {
    event.preventDefault();
    return propose();
  }
  if (popup.hidden) return;
  const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
  if (by) { picked = (picked + by + proposals.length) % proposals.length; drawPopup(); }
  else if (event.key === "Enter" || event.key === "Tab") insert(proposals[picked]);
  else if (event.key === "Escape") closePopup();
  else if (["ArrowLeft", "ArrowRight", "Home", "End", "PageUp", "PageDown"].includes(event.key)) return closePopup();
  else return;
  event.preventDefault();
});
// What is typed on narrows the list.
area.addEventListener("input", () => { if (!popup.hidden) propose(); });
area.addEventListener("blur", () => setTimeout(() => { if (document.activeElement !== area) closePopup(); }, 200));
popup.addEventListener("pointerdown", (event) => {
  const at = event.target.closest("[data-proposal]")?.dataset.proposal;
  event.preventDefault();
  if (at !== undefined) insert(proposals[at]);
});

onOpen((_, again) => {
  place.hidden = false;
  // Texts with errors are only here: they are kept, over another recording too.
  if (unsent || isHeld()) { if (!again) run(); return; }
  if (!again || document.activeElement !== area) read();
});
