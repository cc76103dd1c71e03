// Validates every tile of a tileset by programs that are not ours: the Khronos validator of glTF on the file
// as it is, and on the same file decompressed by the reference decoder; and the tree by the rules of 3D Tiles.
import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import validator from 'gltf-validator';
import { NodeIO, Logger } from '@gltf-transform/core';
import { EXTMeshoptCompression, KHRMeshQuantization } from '@gltf-transform/extensions';
import { MeshoptDecoder } from 'meshoptimizer';

const folder = process.argv[2];
const tileset = JSON.parse(readFileSync(join(folder, 'tileset.json')));
let wrong = 0, tiles = 0, bytes = 0;
const fail = (what) => { if (wrong++ < 20) console.error(what); };
const report = async (name, file, ignored) => {
  const { issues } = await validator.validateBytes(new Uint8Array(file), {
    maxIssues: 20, ignoredIssues: ignored,
  });
  for (const m of issues.messages) if (m.severity < 2) fail(`${name}: ${m.code} ${m.message} ${m.pointer}`);
};
await MeshoptDecoder.ready;
const io = new NodeIO()
  .setLogger(new Logger(Logger.Verbosity.ERROR))
  .registerExtensions([EXTMeshoptCompression, KHRMeshQuantization])
  .registerDependencies({ 'meshopt.decoder': MeshoptDecoder });

const inside = (child, parent) => [0, 1, 2].every((k) =>
  Math.abs(child[k] - parent[k]) + child[3 + 4 * k] <= parent[3 + 4 * k] * (1 + 1e-9) + 1e-9);
const visit = async (tile, parent) => {
  tiles++;
  const file = readFileSync(join(folder, tile.content.uri));
  bytes += file.length;
  if (!(tile.geometricError >= 0)) fail(`${tile.content.uri}: geometricError ${tile.geometricError}`);
  if (parent && tile.geometricError > parent.geometricError) fail(`${tile.content.uri}: error above its parent's`);
  if (parent && !inside(tile.boundingVolume.box, parent.boundingVolume.box)) fail(`${tile.content.uri}: box`);
  await report(tile.content.uri, file, ['UNSUPPORTED_EXTENSION']);
  const document = await io.readBinary(new Uint8Array(file));
  document.getRoot().listExtensionsUsed().forEach((e) => e.extensionName === 'EXT_meshopt_compression' && e.dispose());
  let triangles = 0;
  for (const mesh of document.getRoot().listMeshes()) for (const p of mesh.listPrimitives())
    if (p.getMode() === 4) triangles += p.getIndices().getCount() / 3;
  if (triangles !== tile.extras.outcrop.triangles) fail(`${tile.content.uri}: ${triangles} triangles`);
  await report(`${tile.content.uri} decoded`, await io.writeBinary(document), []);
  for (const child of tile.children ?? []) await visit(child, tile);
};
if (tileset.asset.version !== '1.1') fail('version');
if (tileset.root.refine !== 'REPLACE') fail('refine');
await visit(tileset.root, null);
console.log(`${tiles} tiles, ${bytes} bytes, ${wrong} errors`);
process.exit(wrong ? 1 : 0);
