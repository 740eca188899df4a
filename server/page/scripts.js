// A GET as a command line and as scripts, which all give the same bytes.

export const quote = (text) => `'${text.replaceAll("'", `'\\''`)}'`;

function toCurl(url, { file, isStream, hasKey }) {
  return ['curl', isStream && '--no-buffer', hasKey && '-H "Authorization: Bearer $KEY"', file && `-o ${file}`, quote(url)].filter(Boolean).join(' ');
}

function toJavaScript(url, { file, isStream, hasKey }) {
  const use = file ? ['const bytes = new Uint8Array(await answer.arrayBuffer());', `if (globalThis.process) (await import('node:fs')).writeFileSync('${file}', bytes);`]
    : isStream ? ['const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();', 'for (let part; !(part = await reader.read()).done; ) console.log(part.value);']
    : ['const found = await answer.json();', 'console.log(found);'];
  return ['// Runs in a page, in Deno, and in Node.js as a file that ends with .mjs.',
    ...(hasKey ? ["const key = globalThis.process?.env.KEY ?? prompt('Key');"] : []),
    `const answer = await fetch(${JSON.stringify(url)}${hasKey ? ', { headers: { Authorization: `Bearer ${key}` } }' : ''});`,
    'if (!answer.ok) throw new Error(await answer.text());', ...use].join('\n');
}

function toPython(url, { file, isStream, hasKey }) {
  const asked = hasKey ? `urllib.request.Request(${JSON.stringify(url)}, headers={"Authorization": "Bearer " + os.environ["KEY"]})` : JSON.stringify(url);
  const use = file ? '    shutil.copyfileobj(answer, file)' : isStream ? '    for line in answer:\n        print(line.decode(), end="", flush=True)' : '    print(answer.read().decode())';
  return [...(hasKey ? ['import os'] : []), ...(file ? ['import shutil'] : []), 'import urllib.request', '',
    `with urllib.request.urlopen(${asked}) as answer${file ? `, open("${file}", "wb") as file` : ''}:`, use].join('\n');
}

const WRITERS = { curl: toCurl, JavaScript: toJavaScript, Python: toPython };
export const LANGUAGES = Object.keys(WRITERS);

/** The request in a language. file: where the bytes go; without one they are printed. isStream: printed as they come. */
export const scriptOf = (language, url, options) => WRITERS[language](url, options);
