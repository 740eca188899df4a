// Stands between the daemon and the store, and fails as it is told. Prints its port.
// usage: node tests/s3/proxy.mjs TARGET FAULTS [CERTIFICATE KEY]    with a certificate: https
//
// Each request takes a line from the file FAULTS, if there is one, and keeps the rest; a line "always FAULT"
// stays. METHOD:FAULT is for requests of that method alone. Faults:
//   STATUS [CODE]   an answer of that status, with an S3 error document, or with CODE "empty" without a body
//   untagged        an answer without its ETag
//   cut BYTES       the body of the answer breaks off after so many bytes
//   slow RATE       the body of the answer comes at so many bytes a second
//   hang            no answer
//   reset           the connection is cut
// Every request is a line "METHOD URL RANGE" in FAULTS.log.
import fs from 'node:fs';
import http from 'node:http';
import https from 'node:https';

const target = new URL(process.argv[2]);
const [faults, certificate, key] = process.argv.slice(3);

function takeFault(method) {
  if (!fs.existsSync(faults)) return [];
  const lines = fs.readFileSync(faults, 'utf8').split('\n').filter((line) => line !== '');
  const at = lines.findIndex((line) => {
    const of = line.replace(/^always /, '').match(/^([A-Z]+):/);
    return !of || of[1] === method;
  });
  if (at < 0) return [];
  const always = lines[at].startsWith('always ');
  const words = lines[at].replace(/^always /, '').replace(/^[A-Z]+:/, '').split(' ');
  if (!always) {
    lines.splice(at, 1);
    fs.writeFileSync(faults, lines.map((line) => `${line}\n`).join(''));
  }
  return words;
}

async function send(answer, body, fault, number) {
  let sent = 0;
  for await (const chunk of body) {
    for (let from = 0; from < chunk.length; ) {
      const most = fault === 'cut' ? number - sent : fault === 'slow' ? Math.ceil(number / 20) : chunk.length;
      const piece = chunk.subarray(from, from + most);
      if (piece.length > 0) answer.write(piece);
      from += piece.length;
      sent += piece.length;
      if (fault === 'cut' && sent >= number) {
        await new Promise((resolve) => setTimeout(resolve, 100)); // what was written goes out first
        answer.destroy();
        return;
      }
      if (fault === 'slow') await new Promise((resolve) => setTimeout(resolve, 50));
    }
  }
  answer.end();
}

function answerRequest(request, answer) {
  const [fault, argument] = takeFault(request.method);
  fs.appendFileSync(`${faults}.log`, `${request.method} ${request.url} ${request.headers.range ?? '-'}\n`);
  if (fault === 'hang') return;
  if (fault === 'reset') {
    request.socket.destroy();
    return;
  }
  if (/^[0-9]+$/.test(fault ?? '')) {
    request.resume();
    request.on('end', () => {
      const text = argument === 'empty' ? '' : `<?xml version="1.0"?><Error><Code>${argument ?? 'Fault'}</Code><Message>as told</Message></Error>`;
      answer.writeHead(Number(fault), { 'Content-Type': 'application/xml', 'Content-Length': text.length });
      answer.end(request.method === 'HEAD' ? undefined : text);
    });
    return;
  }
  const upstream = http.request(
    { host: target.hostname, port: target.port, method: request.method, path: request.url, headers: request.headers },
    (response) => {
      if (fault === 'untagged') delete response.headers.etag;
      answer.writeHead(response.statusCode, fault === 'untagged' ? response.headers : response.rawHeaders);
      send(answer, response, fault, Number(argument)).catch(() => answer.destroy());
    },
  );
  upstream.on('error', () => answer.destroy());
  request.pipe(upstream);
}

const server = certificate
  ? https.createServer({ cert: fs.readFileSync(certificate), key: fs.readFileSync(key) }, answerRequest)
  : http.createServer(answerRequest);
server.listen(0, '127.0.0.1', () => console.log(server.address().port));
