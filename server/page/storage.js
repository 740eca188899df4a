// What the page keeps in the browser from visit to visit.

/** A storage that lasts as long as the page, for browsers that keep none. */
class Memory extends Map {
  getItem(key) {
    return this.get(key) ?? null;
  }

  setItem(key, value) {
    this.set(key, value);
  }
}

function open() {
  try {
    localStorage.setItem('tweend-tried', '1');
    return localStorage;
  } catch {
    return new Memory();
  }
}

export const storage = open();
