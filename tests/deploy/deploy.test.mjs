// What docker/ holds beside the image: Kubernetes would take its objects, compose and HAProxy their files, and all of
// them name settings that the daemon has and the version that the tree is.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, readdirSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { parse, parseAllDocuments } from 'yaml';
import { root } from '../node/daemon.mjs';

const docker = join(root, 'docker');
const kubernetes = join(docker, 'kubernetes');
const binary = process.env.TESTED_BINARY ?? join(root, 'build/tweend');
const read = (...path) => readFileSync(join(...path), 'utf8');
const version = read(root, 'CMakeLists.txt').match(/project\(tweend VERSION (\S+)/)[1];
const documents = (text) => parseAllDocuments(text).map((document) => document.toJS());
const has = (command, ...args) => spawnSync(command, args).status === 0;

const kustomization = parse(read(kubernetes, 'kustomization.yaml'));
const plain = kustomization.resources.flatMap((file) => documents(read(kubernetes, file)));
const objects = [...plain, ...documents(read(kubernetes, 'secret.example.yaml'))];
const named = (kind, name = 'tweend') => objects.find((object) => object.kind === kind && object.metadata.name === name);
const pod = named('Deployment').spec.template;

/** Names of settings: every flag as its variable. */
function settings() {
  const help = execFileSync(binary, ['--help'], { encoding: 'utf8' });
  return new Set(help.match(/--[a-z0-9-]+/g).map((flag) => `TWEEND_${flag.slice(2).toUpperCase().replaceAll('-', '_')}`));
}

test('each file of docker/kubernetes is part of the kustomization, but for the secret', () => {
  const files = readdirSync(kubernetes).filter((file) => !/^(kustomization|secret\.example)\.yaml$/.test(file));
  assert.deepEqual([...kustomization.resources].sort(), files.sort());
});

test('the objects are what the API of Kubernetes takes', async (t) => {
  for (const object of objects) {
    await t.test(`${object.kind} ${object.metadata.name}`, async () => {
      const api = object.apiVersion === 'v1' ? 'v1' : object.apiVersion;
      const { [object.kind]: Model } = await import(`kubernetes-models/${api}`);
      assert.ok(Model, `${object.apiVersion} has no ${object.kind}`);
      new Model(object).validate();
    });
  }
});

// The schemas let unknown fields pass; the types made of them do not.
test('the objects have no field that the API does not know', () => {
  const lines = objects.map(({ apiVersion, kind, ...rest }, i) =>
    `import type { I${kind} as I${i} } from 'kubernetes-models/${apiVersion}';\n` +
    `export const object${i}: I${i} = ${JSON.stringify({ apiVersion, kind, ...rest })};\n`);
  const folder = mkdtempSync(join(tmpdir(), 'tweend-types-'));
  try {
    const here = fileURLToPath(new URL('.', import.meta.url));
    symlinkSync(join(here, 'node_modules'), join(folder, 'node_modules'));
    writeFileSync(join(folder, 'objects.ts'), lines.join(''));
    const said = spawnSync(process.execPath, [join(here, 'node_modules/typescript/bin/tsc'), '--noEmit', '--strict',
      '--skipLibCheck', '--module', 'nodenext', '--moduleResolution', 'nodenext', '--target', 'es2022',
      join(folder, 'objects.ts')], { encoding: 'utf8' });
    assert.equal(said.status, 0, said.stdout);
  } finally {
    rmSync(folder, { recursive: true });
  }
});

test('kubectl renders the kustomization', () => {
  const rendered = documents(execFileSync('kubectl', ['kustomize', kubernetes], { encoding: 'utf8' }));
  const names = (list) => list.map(({ kind, metadata }) => `${kind} ${metadata.name}`).sort();
  assert.deepEqual(names(rendered), names(plain));
  const deployment = rendered.find(({ kind }) => kind === 'Deployment');
  assert.equal(deployment.spec.template.spec.containers[0].image, `tweend:${version}`);
});

test('what the objects name is there', () => {
  const labels = pod.metadata.labels;
  const selects = (selector, what) => {
    for (const [key, value] of Object.entries(selector)) assert.equal(labels[key], value, what);
  };
  const [container] = pod.spec.containers;
  const ports = container.ports.map(({ name }) => name);
  selects(named('Deployment').spec.selector.matchLabels, 'Deployment');
  selects(named('PodDisruptionBudget').spec.selector.matchLabels, 'PodDisruptionBudget');
  selects(named('NetworkPolicy').spec.podSelector.matchLabels, 'NetworkPolicy');
  for (const rule of named('NetworkPolicy').spec.ingress) for (const { port } of rule.ports) assert.ok(ports.includes(port));
  for (const service of objects.filter(({ kind }) => kind === 'Service')) {
    selects(service.spec.selector, service.metadata.name);
    for (const { targetPort } of service.spec.ports) assert.ok(ports.includes(targetPort));
  }
  for (const { http } of named('Ingress').spec.rules)
    for (const { backend: { service } } of http.paths)
      assert.ok(named('Service', service.name).spec.ports.some(({ name }) => name === service.port.name));
  for (const probe of ['startupProbe', 'readinessProbe', 'livenessProbe']) assert.ok(ports.includes(container[probe].httpGet.port));
  for (const { name } of container.volumeMounts) assert.ok(pod.spec.volumes.some((volume) => volume.name === name));
  for (const { configMapRef } of container.envFrom) assert.ok(named('ConfigMap', configMapRef.name));
  const { secretName } = pod.spec.volumes.find(({ secret }) => secret).secret;
  const target = named('HorizontalPodAutoscaler').spec.scaleTargetRef;
  assert.ok(named(target.kind, target.name));
  // Files of the secret, as the settings name them.
  const { mountPath } = container.volumeMounts.find(({ name }) => name === 'secrets');
  const files = Object.keys(named('Secret', secretName).stringData).map((file) => `${mountPath}/${file}`);
  const wanted = Object.values(named('ConfigMap').data).filter((value) => value.includes(mountPath));
  assert.deepEqual(wanted.map((value) => value.replace('@', '')).sort(), files.sort());
});

test('pods are refused nothing by the restricted security standard', () => {
  const [container] = pod.spec.containers;
  assert.equal(pod.spec.securityContext.runAsNonRoot, true);
  assert.deepEqual(pod.spec.securityContext.seccompProfile, { type: 'RuntimeDefault' });
  assert.deepEqual(container.securityContext, { allowPrivilegeEscalation: false, readOnlyRootFilesystem: true, capabilities: { drop: ['ALL'] } });
});

test('a pod has time for its delay and its drain', () => {
  const { TWEEND_DRAIN_DELAY, TWEEND_DRAIN_TIMEOUT } = named('ConfigMap').data;
  assert.ok(pod.spec.terminationGracePeriodSeconds > parseInt(TWEEND_DRAIN_DELAY) + parseInt(TWEEND_DRAIN_TIMEOUT));
});

test('settings are those that the daemon has', () => {
  const known = settings();
  const compose = ['compose.yaml', 'compose.scale.yaml'].flatMap((file) => Object.entries(parse(read(docker, file), { merge: true }).services))
    .filter(([name]) => name.startsWith('tweend')).flatMap(([, { environment = {} }]) => Object.keys(environment));
  const image = read(docker, 'Dockerfile').match(/^ENV (.*)$/gm).join(' ').match(/TWEEND_\w+/g);
  const used = [...Object.keys(named('ConfigMap').data), ...compose, ...image].filter((name) => name.startsWith('TWEEND_'));
  assert.deepEqual(used.filter((name) => !known.has(name)), []);
});

test('the version is the tree\'s', () => {
  assert.equal(read(docker, 'Dockerfile').match(/^ARG VERSION=(\S+)/m)[1], version);
  assert.equal(kustomization.images[0].newTag, version);
});

test('compose takes its files', async (t) => {
  const compose = [['docker', 'compose'], ['docker-compose']].find(([command, ...rest]) => has(command, ...rest, 'version'));
  if (!compose) return t.skip('docker-compose is not installed');
  for (const file of ['compose.yaml', 'compose.scale.yaml'])
    execFileSync(compose[0], [...compose.slice(1), '--file', join(docker, file), 'config'], { stdio: ['ignore', 'ignore', 'pipe'] });
});

// Debian's HAProxy; the names of the replicas exist among containers alone.
test('HAProxy takes its file without a warning', () => {
  const env = { ...process.env, TWEEND_1: '127.0.0.1:1', TWEEND_2: '127.0.0.1:2', TWEEND_3: '127.0.0.1:3' };
  const { status, stderr } = spawnSync('haproxy', ['-c', '-q', '-f', join(docker, 'haproxy.cfg')], { env, encoding: 'utf8' });
  assert.deepEqual([status, stderr], [0, '']);
});
