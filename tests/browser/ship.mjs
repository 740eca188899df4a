// A ship that is made of a box by keyboard alone, with the same keys in each browser.

/** What it has in the end. */
export const BY_KEYBOARD = { max: [0.5, 1, 2.5], creases: 30 };

/** The hand that makes it: opens(action) waits for the model that an action opens; enter(name) presses Enter on the button or
 *  the heading of that name; inMenu(key) presses a key once a menu has the focus; type(label, text) writes text in place of what
 *  a field has, and presses Enter; onPicture(...keys) presses keys on the picture. */
export async function buildShip({ opens, enter, inMenu, type, onPicture }) {
  const applies = (...keys) => opens(() => onPicture(...keys));
  await opens(async () => {
    await enter('New shape');
    await inMenu('Enter');
  });
  await opens(() => type('Box: size', '1, 1, 3'));

  // A half of it, cut along the middle.
  await onPicture('2');
  await type('Selection', '[[0, 1]]');
  await applies('Control+r', 'Enter');
  await onPicture('3');
  await type('Selection', '{"inside": {"min": [-1, -1, -2], "max": [0, 1, 2]}}');
  await applies('x');
  await type('Selection', '{"facing": [0, 0, 1]}');
  await applies('e', '1', 'Enter');
  await type('Selection', '{"facing": [0, 1, 0]}');
  await applies('i', '0', '.', '1', 'Enter');
  await applies('e', '0', '.', '5', 'Enter');
  await onPicture('2');
  await type('Selection', '{"sharper_than": 60}');
  await applies('Shift+E', '3', 'Enter');
  await enter('Edits of the whole mesh');
  await opens(() => enter('Mirror'));
}
