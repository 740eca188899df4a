// What the Khronos validator has against a file.
import validator from 'gltf-validator';

const ERROR = 0;
const WARNING = 1;

/** Its errors and warnings, a line each. */
export async function objections(bytes) {
  const report = await validator.validateBytes(new Uint8Array(bytes), { maxIssues: 1000 });
  return report.issues.messages
    .filter((message) => message.severity === ERROR || message.severity === WARNING)
    .map((message) => `${message.code} ${message.pointer ?? ''}: ${message.message}`);
}
