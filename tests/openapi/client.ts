// A program as somebody writes it with a client generated from openapi.json. client.test.mjs makes api.d.ts.
import createClient from 'openapi-fetch';
import type { paths } from './api.js';

declare const process: { argv: string[] };

const url = process.argv[2];
const client = createClient<paths>({ baseUrl: url! });

const check = (holds: boolean, what: string): void => {
  if (!holds) throw new Error(what);
};

const model = {
  meshes: [{ name: 'sail', positions: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], faces: [[0, 1, 2, 3]] }],
  nodes: [{ name: 'mast' }, { name: 'sail', parent: 'mast', mesh: 'sail' }],
  clips: [{ name: 'turn', tracks: [{ node: 'mast', path: 'rotation' as const, interpolation: 'euler' as const,
    unit: 'degrees' as const, times: [0, 2], eulers: [[0, 0, 0], [0, 90, 0]] }] }],
};

const stored = await client.POST('/v1/models', { body: model, params: { query: { name: 'boat' } } });
if (stored.error) throw new Error(stored.error.detail);
const { id, name, meshes } = stored.data;
check(name === 'boat' && meshes[0]?.faces === 1, 'the description is that of the boat');

const described = await client.GET('/v1/models/{id}', { params: { path: { id } } });
check(described.data?.clips[0]?.duration === 2, 'the clip takes two seconds');

const counts = await client.GET('/v1/models/{id}/surface.json', { params: { path: { id }, query: { level: 2, boundary: 'edge-only' } } });
check(counts.data?.faces === 16 && counts.data.vertices === 25, 'a quad has 16 faces at level 2');

const surface = await client.GET('/v1/models/{id}/surface.glb', { params: { path: { id } }, parseAs: 'arrayBuffer' });
check(new DataView(surface.data!).getUint32(0, true) === 0x46546c67, 'a GLB begins with its magic');

const poses = await client.GET('/v1/models/{id}/pose.json', { params: { path: { id }, query: { at: '1', as: 'euler', unit: 'degrees' } } });
check(Math.abs(poses.data!.poses[0]!.euler![0]![1]! - 45) < 1e-4, 'half the way is 45 degrees');

const timed = await client.POST('/v1/models/{id}/pose.json', { params: { path: { id } }, body: { times: [0, 2] } });
check(timed.data?.poses.length === 2, 'two times are two poses');

// Whatever has a default may be left out.
const drum = await client.POST('/v1/models', { body: { meshes: [{ name: 'drum', shape: { kind: 'cylinder' } }], clips: [] } });
check(drum.data?.meshes[0]?.faces === 18, 'sixteen sides and two caps');
const lid = await client.POST('/v1/models/{id}/edits', {
  params: { path: { id: drum.data!.id } },
  body: { edits: [{ edit: 'extrude', faces: { facing: [0, 1, 0] }, distance: 1 }, { edit: 'fill', optional: true }] },
});
check(lid.data?.meshes[0]?.faces === 34, 'an extruded cap has sixteen more');

const signed = await client.POST('/v1/sign', { body: { url: `/v1/models/${id}/surface.glb` } });
check(signed.response.status === 404, 'without keys no URL is signed');

const converted = await client.POST('/v1/rotations', { body: { rotations: [{ euler: [0, 0, 0] }] } });
check(converted.data!.rotations[0]!.quaternion![3] === 1, 'angles of zero are the unit quaternion');

const turned = await client.POST('/v1/rotations', { body: { rotations: [{ axis_angle: [0, 1, 0, 90] }], unit: 'degrees', as: 'euler' } });
check(Math.abs(turned.data!.rotations[0]!.euler![1]! - 90) < 1e-4, 'a quarter turn about y is 90 degrees');

const missing = await client.GET('/v1/models/{id}', { params: { path: { id: '0'.repeat(32) } } });
check(missing.data === undefined && missing.error?.status === 404, 'an error is a problem document');

const gone = await client.DELETE('/v1/models/{id}', { params: { path: { id } } });
check(gone.response.status === 204, 'the model is deleted');
