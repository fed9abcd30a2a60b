// Validates glTF files: node validate.mjs FILE...
// Prints one line an issue, and leaves with 1 where there is an error or a warning, 2 where a file cannot be read.
import { readFile } from 'node:fs/promises';
import { validateBytes } from 'gltf-validator';

const SEVERITIES = ['error', 'warning', 'info', 'hint'];

async function validate(path) {
  const bytes = new Uint8Array(await readFile(path));
  const { issues } = await validateBytes(bytes, { uri: path, maxIssues: 100 });
  for (const { severity, code, message, pointer, offset } of issues.messages) {
    console.log(`${path}: ${SEVERITIES[severity]}: ${code} at ${pointer ?? `byte ${offset}`}: ${message}`);
  }
  const { numErrors, numWarnings, numInfos, numHints } = issues;
  console.log(`${path}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints`);
  return numErrors + numWarnings;
}

const paths = process.argv.slice(2);
if (paths.length === 0) {
  console.error('usage: node validate.mjs FILE...');
  process.exit(2);
}
try {
  let problems = 0;
  for (const path of paths) {
    problems += await validate(path);
  }
  process.exitCode = problems > 0 ? 1 : 0;
} catch (error) {
  console.error(`${error}`);
  process.exitCode = 2;
}
