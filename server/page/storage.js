// What the page keeps in the browser: from visit to visit, and for as long as a tab is open.

/** A storage that lasts as long as the page, for browsers that keep none. */
class Memory extends Map {
  getItem(key) {
    return this.get(key) ?? null;
  }

  setItem(key, value) {
    this.set(key, value);
  }

  removeItem(key) {
    this.delete(key);
  }
}

function open(name) {
  try {
    const found = globalThis[name];
    found.setItem('tweend-tried', '1');
    return found;
  } catch {
    return new Memory();
  }
}

export const storage = open('localStorage');
export const ofTab = open('sessionStorage');
