import { h } from "../viewer/dom";

/** The form that saves the design as a file beside the one that is open. */
export class Saving {
  private readonly file = h("input", { type: "text", "aria-label": "name of the new file", size: 28, spellcheck: "false", autocomplete: "off" });
  private readonly overwrite = h("button", { type: "button", hidden: true }, "Replace it");
  private readonly said = h("span", { role: "status" });

  constructor(
    private readonly form: HTMLFormElement,
    save: (file: string, overwrite: boolean) => void,
  ) {
    const close = h("button", { type: "button", click: () => this.close() }, "Cancel");
    form.append(h("label", {}, "New file beside the open one: ", this.file), h("button", { type: "submit" }, "Save"), this.overwrite, close, this.said);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.overwrite.hidden = true;
      save(this.file.value.trim(), false);
    });
    this.overwrite.addEventListener("click", () => save(this.file.value.trim(), true));
    form.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.close();
    });
  }

  /** Open the form, with a name that is proposed. */
  open(file: string): void {
    if (this.file.value === "") this.file.value = file;
    this.overwrite.hidden = true;
    this.say("");
    this.form.hidden = false;
    this.file.focus();
    this.file.select();
  }

  exists(file: string): void {
    this.say(`${file} exists already.`, "warning");
    this.overwrite.hidden = false;
    this.overwrite.focus();
  }

  saved(file: string): void {
    this.overwrite.hidden = true;
    this.say(`${file} is written.`, "good");
  }

  failed(text: string): void {
    this.overwrite.hidden = true;
    this.say(text, "bad");
  }

  private say(text: string, kind = ""): void {
    this.said.textContent = text;
    this.said.className = kind;
  }

  private close(): void {
    this.form.hidden = true;
    document.getElementById("live-save")?.focus();
  }
}
