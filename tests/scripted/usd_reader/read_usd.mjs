// Reads a USD file with tinyusdz and prints what it understood, as JSON: the layer as tinyusdz writes it again, and the meshes
// that it would hand to a renderer at the default time, unless only the layer is wanted.
//
//   node read_usd.mjs NODE_MODULES FILE [layer]
import fs from "node:fs";
import path from "node:path";
import { pathToFileURL } from "node:url";

const [modules, file, part] = process.argv.slice(2);
const folder = path.join(path.resolve(modules), "tinyusdz");

// The package is built for browsers, and for Node within one (Electron calls such processes renderers).
process.type = "renderer";
globalThis.window = globalThis;
const { default: load } = await import(pathToFileURL(path.join(folder, "tinyusdz.mjs")));
const program = new WebAssembly.Module(fs.readFileSync(path.join(folder, "tinyusdz.wasm")));
const usd = await load({
  instantiateWasm(imports, done) {
    const instance = new WebAssembly.Instance(program, imports);
    done(instance, program);
    return instance.exports;
  },
});

function reader(method) {
  const made = new usd.TinyUSDZLoaderNative();
  if (!made[method](new Uint8Array(fs.readFileSync(file)), path.basename(file)) || made.error())
    throw new Error(`${file}: ${made.error() || "not understood"}`);
  return made;
}

const meshes = {};
if (part !== "layer") {
  const stage = reader("loadFromBinary");
  for (let i = 0; i < stage.numMeshes(); ++i) {
    const mesh = stage.getMesh(i);
    const arrays = Object.entries(mesh).filter(([, value]) => ArrayBuffer.isView(value));
    meshes[mesh.absPath] = Object.fromEntries(arrays.map(([name, value]) => [name, Array.from(value)]));
  }
}
const text = reader("loadAsLayerFromBinary").layerToString();
fs.writeSync(1, JSON.stringify({ text, meshes }));
