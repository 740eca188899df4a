// Input fields for the parameters of shapes, edits and strokes: numbers as people write them.
import { make, select } from './dom.js';
import { CHOICES, parameterWords } from './shapes.js';

/** The numbers of a text: between blanks, semicolons or commas; a comma within a number is a decimal point where the
 *  browser's language writes it so. NaN stands for what is no number. */
function numbersOf(text) {
  const hasDecimalComma = (0.5).toLocaleString().includes(',');
  const isBlankSeparated = /[\s;]/.test(text.trim());
  const words = text.split(hasDecimalComma && (isBlankSeparated || text.split(',').length === 2) ? /[\s;]+/ : /[\s;,]+/);
  return words.map((word) => word.replace(/,$/, '')).filter(Boolean).map((word) => Number(hasDecimalComma ? word.replace(',', '.') : word));
}

/** Creates input fields for parameters, typed by their initial values. use() is called for Enter in one. read() returns
 *  the present values; null, with a mark on the field, where one is no number. */
export function fieldsOf(parameters, about, use = () => {}) {
  const fields = Object.entries(parameters).map(([name, value]) => {
    const words = parameterWords(name);
    const label = `${about}: ${words}`;
    const labelled = (input) => make('label', { className: 'parameter' }, make('span', { 'aria-hidden': 'true' }, words), input);
    if (CHOICES[name]) {
      const list = select(CHOICES[name].map((text) => [text, text]), value, () => {}, { 'aria-label': label });
      return { name, read: () => list.value, label: labelled(list) };
    }
    const input = make('input', { type: 'text', 'aria-label': label, value: [value].flat().join(', '), autocomplete: 'off',
      oninput: () => tell(''), onchange: () => check(), onkeydown: (event) => event.key === 'Enter' && use() });
    const tell = (fault) => {
      input.setCustomValidity(fault);
      input.setAttribute('aria-invalid', fault !== '');
    };
    const wanted = [value].flat().length;
    const check = () => {
      const numbers = numbersOf(input.value);
      const isGood = numbers.length === wanted && numbers.every(Number.isFinite);
      tell(isGood ? '' : wanted === 1 ? 'A number is expected.' : `${wanted} numbers are expected.`);
      return isGood ? (Array.isArray(value) ? numbers : numbers[0]) : undefined;
    };
    const read = () => {
      const given = check();
      if (given === undefined) input.reportValidity();
      return given;
    };
    return { name, read, label: labelled(input) };
  });
  const read = () => {
    const values = fields.map(({ name, read: readField }) => [name, readField()]);
    return values.some(([, value]) => value === undefined) ? null : Object.fromEntries(values);
  };
  return { labels: fields.map(({ label }) => label), read };
}
