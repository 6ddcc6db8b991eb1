// The manifests of deploy/kubernetes, rendered by `kubectl kustomize`: right by the schemas of Kubernetes' API, and what
// they say of each other and of wellspaced is so.
//
// WELLSPACE_BIN_DIR has the server; WELLSPACE_KUBECTL may name another kubectl. No cluster is asked.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import path from 'node:path';
import {test} from 'node:test';
import {fileURLToPath} from 'node:url';

import {parseAllDocuments} from 'yaml';

const require = createRequire(import.meta.url);
const FOLDER = fileURLToPath(new URL('../../deploy/kubernetes', import.meta.url));
// They are compiled from the schemas of the API. The classes of the package that use them copy an object first.
const SCHEMAS = fileURLToPath(new URL('node_modules/kubernetes-models/_schemas', import.meta.url));
const KUBECTL = process.env.WELLSPACE_KUBECTL || 'kubectl';
const OVERLAYS = ['base', 'overlays/plain-text', 'overlays/console', 'overlays/calls'];
const USER = 7233;

function render(overlay) {
  const done = spawnSync(KUBECTL, ['kustomize', path.join(FOLDER, overlay)], {encoding: 'utf8'});
  assert.equal(done.status, 0, done.stderr);
  return parseAllDocuments(done.stdout).map((document) => {
    assert.deepEqual(document.errors, []);
    return document.toJS();
  });
}

const rendered = Object.fromEntries(OVERLAYS.map((overlay) => [overlay, render(overlay)]));
const only = (overlay, kind) => {
  const found = rendered[overlay].filter((object) => object.kind === kind);
  assert.equal(found.length, 1, `${overlay} has one ${kind}`);
  return found[0];
};
const podOf = (overlay) => only(overlay, 'StatefulSet').spec.template;
const optionsOf = (overlay) => only(overlay, 'ConfigMap').data;

// `value`, which notes in `unread` the path of each field until it is read.
function watched(value, place, unread) {
  if (value === null || typeof value !== 'object') {
    return value;
  }
  const paths = Object.fromEntries(Object.keys(value).map((key) => [key, `${place}/${key}`]));
  Object.values(paths).forEach((field) => unread.add(field));
  const target = Array.isArray(value) ? [] : {};
  for (const key of Object.keys(value)) {
    target[key] = watched(value[key], paths[key], unread);
  }
  return new Proxy(target, {
    get(fields, key) {
      unread.delete(paths[key]);
      return fields[key];
    },
  });
}

// Throws unless `object` is right by its schema. The schemas take fields that they do not know, as a cluster would not:
// these are the fields that no schema reads.
function validate(object) {
  const group = object.apiVersion.split('/').map((part) => part[0].toUpperCase() + part.slice(1).split('.')[0]);
  const name = `IoK8sApi${group.length === 1 ? 'Core' : ''}${group.join('')}${object.kind}`;
  const {validate: holds} = require(path.join(SCHEMAS, `${name}.js`));
  const unread = new Set();
  assert.ok(holds(watched(object, object.kind, unread)), JSON.stringify(holds.errors));
  assert.deepEqual([...unread], [], 'fields that the API does not have');
}

// wellspaced --check-config with these variables and no others.
function check(variables) {
  return spawnSync(path.join(process.env.WELLSPACE_BIN_DIR, 'wellspaced'), ['--check-config'],
      {encoding: 'utf8', env: variables});
}

test('every object is right by its schema', () => {
  for (const overlay of OVERLAYS) {
    rendered[overlay].forEach(validate);
  }
});

test('the schemas refuse what is wrong', () => {
  const set = structuredClone(only('base', 'StatefulSet'));
  set.spec.template.spec.containers[0].readinessProbe.httpGet.prot = 9464;
  assert.throws(() => validate(set), /httpGet\/prot/);
  const count = structuredClone(only('base', 'StatefulSet'));
  count.spec.replicas = 'one';
  assert.throws(() => validate(count), /replicas/);
  const autoscaler = structuredClone(only('overlays/calls', 'HorizontalPodAutoscaler'));
  delete autoscaler.spec.scaleTargetRef;
  assert.throws(() => validate(autoscaler), /scaleTargetRef/);
});

test('every variable is an option of wellspaced', () => {
  for (const overlay of OVERLAYS) {
    const run = check(optionsOf(overlay));
    // Certificates and tokens are where the secrets are mounted.
    if (overlay === 'overlays/plain-text') {
      assert.equal(run.status, 0, run.stderr);
    } else {
      assert.match(run.stderr, /\/etc\/wellspace\/tls\/tls\.(crt|key)/);
    }
    for (const [variable, value] of Object.entries(optionsOf(overlay))) {
      const option = variable.replace('WELLSPACED_', '').toLowerCase().replaceAll('_', '-');
      assert.match(run.stdout, value === '' ? new RegExp(`^# ${option} is not set$`, 'm') :
                                              new RegExp(`^${option} = .*${variable}$`, 'm'));
    }
  }
});

test('ports, probes and names fit each other', () => {
  for (const overlay of OVERLAYS) {
    const pod = podOf(overlay);
    const server = pod.spec.containers.find((one) => one.name === 'wellspaced');
    const ports = Object.fromEntries(server.ports.map((port) => [port.name, port.containerPort]));
    assert.equal(optionsOf(overlay).WELLSPACED_LISTEN, `0.0.0.0:${ports.grpc}`);
    assert.equal(optionsOf(overlay).WELLSPACED_METRICS_LISTEN, `0.0.0.0:${ports.metrics}`);
    assert.equal(server.livenessProbe.httpGet.path, '/livez');
    assert.equal(server.startupProbe.httpGet.path, '/readyz');
    const ready = server.readinessProbe;
    assert.ok(ready.grpc ? ready.grpc.port === ports.grpc && !ready.httpGet : ready.httpGet.path === '/readyz');
    assert.ok(pod.spec.terminationGracePeriodSeconds > Number(optionsOf(overlay).WELLSPACED_GRACE));
    assert.equal(server.envFrom[0].configMapRef.name, only(overlay, 'ConfigMap').metadata.name);
    for (const object of rendered[overlay]) {
      const selector = object.spec?.selector?.matchLabels ?? object.spec?.podSelector?.matchLabels ??
          (object.kind === 'Service' ? object.spec.selector : {});
      for (const [label, value] of Object.entries(selector)) {
        assert.equal(pod.metadata.labels[label], value, `${object.kind} selects the pods`);
      }
      for (const port of object.kind === 'Service' ? object.spec.ports : []) {
        assert.equal(ports[port.targetPort], port.port);
      }
    }
  }
});

test('every mount has its volume, and every volume a mount', () => {
  for (const overlay of OVERLAYS) {
    const set = only(overlay, 'StatefulSet').spec;
    const claims = (set.volumeClaimTemplates ?? []).map((claim) => claim.metadata.name);
    const volumes = [...claims, ...(set.template.spec.volumes ?? []).map((volume) => volume.name)].sort();
    const mounts = set.template.spec.containers.flatMap((one) => (one.volumeMounts ?? []).map((mount) => mount.name));
    assert.deepEqual([...new Set(mounts)].sort(), volumes);
  }
});

test('pods have no rights that they do not need', () => {
  for (const overlay of OVERLAYS) {
    const {spec} = podOf(overlay);
    assert.equal(spec.securityContext.runAsNonRoot, true);
    assert.equal(spec.securityContext.runAsUser, USER);
    assert.equal(spec.securityContext.seccompProfile.type, 'RuntimeDefault');
    assert.equal(spec.automountServiceAccountToken, false);
    assert.equal(spec.enableServiceLinks, false);
    for (const {securityContext, resources} of spec.containers) {
      assert.equal(securityContext.readOnlyRootFilesystem, true);
      assert.equal(securityContext.allowPrivilegeEscalation, false);
      assert.deepEqual(securityContext.capabilities.drop, ['ALL']);
      assert.ok(resources.limits.memory);
    }
    assert.deepEqual(only(overlay, 'NetworkPolicy').spec.egress ?? [], []);
  }
});

test('a folder of sessions has one server, and only servers without one are many', () => {
  for (const overlay of OVERLAYS.filter((name) => name !== 'overlays/calls')) {
    assert.equal(only(overlay, 'StatefulSet').spec.replicas, 1);
    assert.ok(optionsOf(overlay).WELLSPACED_DATA.startsWith('/var/lib/wellspace/'));
  }
  const set = only('overlays/calls', 'StatefulSet').spec;
  assert.equal(set.volumeClaimTemplates, undefined);
  assert.equal(set.replicas, undefined);
  assert.equal(optionsOf('overlays/calls').WELLSPACED_EPHEMERAL, 'true');
  const {metric} = only('overlays/calls', 'HorizontalPodAutoscaler').spec.metrics[0].pods;
  const metrics = readFileSync(path.join(FOLDER, '../../docs/operations.md'), 'utf8');
  assert.ok(metrics.includes(`\`${metric.name}\``));
});
