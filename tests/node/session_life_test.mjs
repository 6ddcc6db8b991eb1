// The whole life of a session from Node.js: @grpc/grpc-js, the protos, and nothing else of this project.
//
// WELLSPACE_BIN_DIR has the server; `npm ci` has put the packages beside this file.
import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {once} from 'node:events';
import path from 'node:path';
import readline from 'node:readline';
import {after, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';

import grpc from '@grpc/grpc-js';
import protoLoader from '@grpc/proto-loader';
import protobuf from 'protobufjs';

const PROTOS = fileURLToPath(new URL('../../proto', import.meta.url));
const FILES = ['meshing', 'sessions', 'operations', 'queries'].map((name) => `wellspace/v1/${name}.proto`);
const PATIENCE_MS = 240_000;
const DIMENSION = 2;

const definitions = protoLoader.loadSync([...FILES, 'grpc/health/v1/health.proto'], {
  includeDirs: [PROTOS],
  longs: Number,
  enums: String,
  defaults: true,
  oneofs: true,
});
const api = grpc.loadPackageDefinition(definitions);

// Messages on their own, for the details of errors.
const messages = new protobuf.Root();
messages.resolvePath = (_, file) => protobuf.util.path.resolve(`${PROTOS}/`, file);
messages.loadSync(['google/rpc/status.proto', 'google/rpc/error_details.proto'], {keepCase: false});

let server;
let clients;

before(async () => {
  server = spawn(path.join(process.env.WELLSPACE_BIN_DIR, 'wellspaced'), ['--listen', '127.0.0.1:0'], {
    stdio: ['ignore', 'pipe', 'ignore'],
  });
  const [line] = await once(readline.createInterface({input: server.stdout}), 'line');
  assert.match(line, /^listening on /);
  const address = line.replace('listening on ', '');
  const credentials = grpc.credentials.createInsecure();
  const {MeshingService, SessionService, OperationService, QueryService} = api.wellspace.v1;
  clients = {
    meshing: new MeshingService(address, credentials),
    sessions: new SessionService(address, credentials),
    operations: new OperationService(address, credentials),
    queries: new QueryService(address, credentials),
    health: new api.grpc.health.v1.Health(address, credentials),
  };
});

after(async () => {
  for (const client of Object.values(clients)) client.close();
  const exit = once(server, 'exit');
  server.kill('SIGTERM');
  assert.deepEqual(await exit, [0, null]);
});

const deadline = () => ({deadline: Date.now() + PATIENCE_MS});

/** The answer of a call of one message. */
function call(client, method, request) {
  return new Promise((resolve, reject) => {
    client[method](request, deadline(), (error, response) => (error ? reject(error) : resolve(response)));
  });
}

/** The answer of a call that takes a stream of messages. */
function send(client, method, requests) {
  return new Promise((resolve, reject) => {
    const stream = client[method](deadline(), (error, response) => (error ? reject(error) : resolve(response)));
    for (const request of requests) stream.write(request);
    stream.end();
  });
}

/** All messages of a stream. */
async function collect(stream) {
  const messages = [];
  for await (const message of stream) messages.push(message);
  return messages;
}

/** The google.rpc details of an error, by the names of their types. */
function detailsOf(error) {
  const [bytes] = error.metadata.get('grpc-status-details-bin');
  const status = messages.lookupType('google.rpc.Status').decode(bytes);
  return Object.fromEntries(status.details.map((packed) => {
    const name = packed.type_url.split('/').pop();
    return [name, messages.lookupType(name).decode(packed.value)];
  }));
}

/** The details of the error that `promise` ends with, of which code and reason are as expected. */
async function failure(promise, code, reason) {
  let details;
  await assert.rejects(promise, (error) => {
    assert.equal(error.code, grpc.status[code], error.message);
    details = detailsOf(error);
    const {domain, reason: found} = details['google.rpc.ErrorInfo'];
    assert.deepEqual([domain, found], ['wellspace.v1', `ERROR_REASON_${reason}`]);
    return true;
  });
  return details;
}

const box = {low: Array(DIMENSION).fill(0), high: Array(DIMENSION).fill(1)};
const parameters = (others = {}) => ({dimension: DIMENSION, domain: box, ...others});

/** Points of the unit box, by a generator of its own: the same each time. */
function uniform(count, seed) {
  let state = seed >>> 0;
  const next = () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return 0.05 + 0.9 * (state / 2 ** 32);
  };
  return Float64Array.from({length: count * DIMENSION}, next);
}

const create = async (others = {}) =>
  (await call(clients.sessions, 'createSession', {parameters: parameters(), ...others})).session;
const get = async (name) => (await call(clients.sessions, 'getSession', {name})).session;

/** The requests of an upload of the points from number `offset` on, so many in each. */
function* pieces(name, points, offset, rows) {
  for (let first = offset; first * DIMENSION < points.length; first += rows) {
    const coordinates = Array.from(points.subarray(first * DIMENSION, (first + rows) * DIMENSION));
    yield {name, pointOffset: first, points: {coordinates}};
  }
}

/** One call that breaks off, then one that goes on where the server has got to, with some points twice. */
async function uploadInResumablePieces(name, points) {
  const [first] = pieces(name, points, 0, 100);
  let broken;
  const ended = new Promise((resolve) => {
    broken = clients.sessions.uploadPoints(deadline(), resolve);
  });
  broken.write(first);
  while ((await get(name)).committedPoints < 100);
  broken.cancel();
  assert.equal((await ended).code, grpc.status.CANCELLED);

  await failure(send(clients.sessions, 'uploadPoints', pieces(name, points, 101, 100)), 'OUT_OF_RANGE', 'UPLOAD_GAP');
  const uploaded = await send(clients.sessions, 'uploadPoints', pieces(name, points, 50, 333));
  assert.equal(uploaded.committedPoints, points.length / DIMENSION);
}

/** Watches an operation to its end: the operation, and the events. */
async function watch(name, request = {}) {
  const all = await collect(clients.operations.watchOperation({name, ...request}, deadline()));
  const last = all.pop();
  assert.equal(last.response, 'operation');
  return {operation: last.operation, events: all.map((one) => one.progress)};
}

async function refine(name, changed = {}) {
  const request = {name, parameters: parameters(changed)};
  const {operation} = await call(clients.operations, 'startRefinement', request);
  return watch(operation.name);
}

/** Metadata and chunks. */
async function download(name, request = {}) {
  const [first, ...rest] = await collect(clients.sessions.downloadMesh({name, ...request}, deadline()));
  return {metadata: first.metadata, chunks: rest.map((one) => one.chunk)};
}

const CRC_TABLE = Uint32Array.from({length: 256}, (_, value) => {
  for (let bit = 0; bit < 8; ++bit) value = (value >>> 1) ^ (value & 1 ? 0x82f63b78 : 0);
  return value >>> 0;
});

function crc32c(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) crc = CRC_TABLE[(crc ^ byte) & 0xff] ^ (crc >>> 8);
  return (crc ^ 0xffffffff) >>> 0;
}

const ARRAYS = {points: Float64Array, simplices: Uint32Array, inputVertices: Uint32Array};

/** The arrays of a mesh, put together of its chunks, each of which is checked. */
function assemble({metadata, chunks}) {
  assert.deepEqual(chunks.map((chunk) => chunk.index), Array.from({length: metadata.chunkCount}, (_, i) => i));
  const mesh = {points: [], simplices: [], inputVertices: []};
  for (const chunk of chunks) {
    const [name] = Object.keys(ARRAYS).filter((array) => chunk[array].length > 0);
    const values = ARRAYS[name].from(chunk[name]);
    assert.equal(crc32c(new Uint8Array(values.buffer)), chunk.crc32c, `chunk ${chunk.index}`);
    mesh[name] = mesh[name].concat(chunk[name]);
  }
  assert.equal(mesh.points.length, metadata.vertexCount * DIMENSION);
  assert.equal(mesh.simplices.length, metadata.simplexCount * (DIMENSION + 1));
  return mesh;
}

/** The coordinates of these vertices. */
const rows = (mesh, vertices) =>
  vertices.flatMap((vertex) => mesh.points.slice(vertex * DIMENSION, (vertex + 1) * DIMENSION));

/** Of all triangles; each must be positively oriented. */
function areaOf(mesh) {
  let area = 0;
  for (let i = 0; i < mesh.simplices.length; i += 3) {
    const [ax, ay, bx, by, cx, cy] = rows(mesh, mesh.simplices.slice(i, i + 3));
    const one = ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2;
    assert.ok(one > 0);
    area += one;
  }
  return area;
}

test('the whole life of a session', async () => {
  const points = uniform(3000, 1);
  const {name, state, revision} = await create({labels: {who: 'node'}, requestId: 'node-1'});
  assert.match(name, /^sessions\/[^/]+$/);
  assert.deepEqual([state, revision], ['STATE_OPEN', 1]);
  assert.equal((await create({labels: {who: 'node'}, requestId: 'node-1'})).name, name, 'a repetition');

  await uploadInResumablePieces(name, points);

  const size = {maxCircumradius: 0.004};
  const estimate = await send(clients.meshing, 'estimateMesh', [
    {parameters: parameters(size)},
    {points: {coordinates: Array.from(points)}},
  ]);

  // Refine, and watch: from the start, late, and after a part of the events.
  const {operation, events} = await refine(name, size);
  assert.equal(operation.state, 'STATE_SUCCEEDED');
  assert.equal(events.at(-1).phase, 'PHASE_DONE');
  assert.equal(events.at(-1).fraction, 1);
  for (const figure of ['sequence', 'vertices', 'simplices', 'fraction']) {
    const figures = events.map((event) => event[figure]);
    assert.deepEqual(figures, [...figures].sort((a, b) => a - b), figure);
  }
  const late = await watch(operation.name);
  assert.deepEqual([late.operation, late.events.at(-1)], [operation, events.at(-1)]);
  assert.deepEqual(await watch(operation.name, {afterSequence: events.at(-1).sequence}), {operation, events: []});

  // Download: all, then from a chunk on.
  const whole = await download(name, {revision: operation.meshRevision});
  const mesh = assemble(whole);
  assert.deepEqual(rows(mesh, mesh.inputVertices), Array.from(points));
  assert.ok(Math.abs(areaOf(mesh) - 1) < 1e-12);
  const {vertexCount} = whole.metadata;
  assert.ok(Math.abs(Math.log(estimate.vertices / vertexCount)) < Math.log(1.5));
  const continued = await download(name, {revision: whole.metadata.revision, nextChunk: 1});
  assert.deepEqual(continued, {metadata: whole.metadata, chunks: whole.chunks.slice(1)});

  // Queries, each of all vertices in one call.
  const near = await collect(clients.queries.approximateNearestNeighbors({name}, deadline()));
  const nearest = near.flatMap((batch) => batch.distances);
  assert.equal(nearest.length, vertexCount);
  const vertices = Array.from({length: vertexCount}, (_, i) => vertexCount - 1 - i);
  const clipped = await collect(clients.queries.clippedVoronoiCells({name, vertices, beta: 1.5}, deadline()));
  assert.ok(clipped.length > 1 && clipped.length < vertexCount / 100, `${clipped.length} batches`);
  assert.deepEqual(clipped.flatMap(({cells}) => cells.vertices), vertices);
  assert.deepEqual(clipped.flatMap(({cells}) => cells.clipRadii), nearest.map((one) => 1.5 * one).reverse());
  const [{cells}] = await collect(clients.queries.voronoiCells({name, vertices: [7, 0]}, deadline()));
  assert.deepEqual(cells.vertices, [7, 0]);
  assert.equal(cells.nodes.length, DIMENSION * (cells.nodeCounts[0] + cells.nodeCounts[1]));
  const {'google.rpc.BadRequest': blamed} = await failure(
    collect(clients.queries.voronoiCells({name, vertices: [0, vertexCount]}, deadline())),
    'OUT_OF_RANGE',
    'VERTEX_OUT_OF_RANGE',
  );
  assert.equal(blamed.fieldViolations[0].field, 'vertices[1]');

  // Add vertices, each near one that there is, and refine again.
  const more = Array.from(uniform(20, 2));
  const nearby = Array.from({length: 20}, (_, i) => i);
  const added = await call(clients.queries, 'addVertices', {name, points: more, near: nearby});
  assert.equal((await get(name)).state, 'STATE_OPEN');
  assert.equal((await refine(name, size)).operation.state, 'STATE_SUCCEEDED');
  assert.equal((await get(name)).state, 'STATE_READY');
  const finer = assemble(await download(name));
  assert.deepEqual(rows(finer, added.vertices), more);
  assert.deepEqual(finer.points.slice(0, mesh.points.length), mesh.points, 'vertices keep their numbers');
  assert.ok(Math.abs(areaOf(finer) - 1) < 1e-12);
  const {operations} = await call(clients.operations, 'listOperations', {parent: name});
  assert.deepEqual(operations.map((one) => one.state), ['STATE_SUCCEEDED', 'STATE_SUCCEEDED']);

  // The old mesh is no longer there; then nothing is.
  const old = {name, revision: whole.metadata.revision, nextChunk: 1};
  const gone = collect(clients.sessions.downloadMesh(old, deadline()));
  await failure(gone, 'FAILED_PRECONDITION', 'REVISION_MISMATCH');
  await call(clients.sessions, 'deleteSession', {name});
  await failure(get(name), 'NOT_FOUND', 'SESSION_NOT_FOUND');
});

test('lists have pages and filters', async () => {
  const names = [];
  for (let i = 0; i < 5; ++i) names.push((await create({labels: {list: 'node', number: `${i}`}})).name);
  const pages = [];
  let pageToken = '';
  do {
    const page = await call(clients.sessions, 'listSessions', {pageSize: 2, pageToken, labels: {list: 'node'}});
    pages.push(page.sessions.map((session) => session.name));
    pageToken = page.nextPageToken;
  } while (pageToken);
  assert.deepEqual(pages, [names.slice(0, 2), names.slice(2, 4), names.slice(4)]);
  const {sessions} = await call(clients.sessions, 'listSessions', {labels: {list: 'node', number: '3'}});
  assert.deepEqual(sessions.map((session) => session.name), [names[3]]);
  for (const name of names) await call(clients.sessions, 'deleteSession', {name});
});

test('errors carry their details', async () => {
  const wrong = call(clients.sessions, 'createSession', {parameters: {dimension: 9}});
  const {'google.rpc.BadRequest': blamed} = await failure(wrong, 'INVALID_ARGUMENT', 'INVALID_PARAMETERS');
  assert.deepEqual(blamed.fieldViolations.map((one) => one.field), ['parameters.dimension']);
  assert.match(blamed.fieldViolations[0].description, /9/);

  const {name} = await create();
  const {operation} = await refine(name, {maxVertices: 3});
  assert.deepEqual([operation.state, operation.error.code], ['STATE_FAILED', grpc.status.RESOURCE_EXHAUSTED]);
  const update = {session: {name}, expectedRevision: 99};
  await failure(call(clients.sessions, 'updateSession', update), 'ABORTED', 'REVISION_MISMATCH');
  await call(clients.sessions, 'deleteSession', {name});
});

test('all in one call', async () => {
  const points = uniform(300, 3);
  const stream = clients.meshing.meshPoints(deadline());
  stream.write({parameters: parameters()});
  stream.write({points: {coordinates: Array.from(points)}});
  stream.end();
  const all = await collect(stream);
  const chunks = all.filter((one) => one.response === 'chunk').map((one) => one.chunk);
  const [{metadata}] = all.filter((one) => one.response === 'metadata');
  assert.equal(all[0].response, 'progress');
  const mesh = assemble({metadata, chunks});
  assert.deepEqual(mesh.points.slice(0, points.length), Array.from(points));
  assert.ok(Math.abs(areaOf(mesh) - 1) < 1e-12);
});

test('the server tells about itself', async () => {
  const info = await call(clients.meshing, 'getServerInfo', {});
  assert.deepEqual(info.dimensions, [2, 3, 4, 5, 6]);
  assert.equal((await call(clients.health, 'check', {})).status, 'SERVING');
});
