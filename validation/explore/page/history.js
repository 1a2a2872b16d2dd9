// The states that were rested at, so that one can go back.

const MOST = 200;

export class History {
  constructor(changed) {
    Object.assign(this, { changed, states: [], at: -1 });
  }

  get before() { return this.at > 0; }

  get after() { return this.at < this.states.length - 1; }

  // What is the same as the last is not kept; what was undone is forgotten.
  keep(state) {
    const text = JSON.stringify(state);
    if (text === this.states[this.at]) return;
    this.states = [...this.states.slice(0, this.at + 1), text].slice(-MOST);
    this.at = this.states.length - 1;
    this.changed();
  }

  undo() { return this.step(-1); }

  redo() { return this.step(1); }

  step(by) {
    if (by < 0 ? !this.before : !this.after) return null;
    this.at += by;
    this.changed();
    return JSON.parse(this.states[this.at]);
  }
}
