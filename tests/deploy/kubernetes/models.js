// Checks objects of Kubernetes by kubernetes-models: reads a JSON list of lists of objects from standard input, and prints for
// each inner list the problems that it found. The models let unknown fields pass, so each object is then validated again
// behind a proxy that notes which fields the model asks for: a field that it never asks for is unknown to it.
"use strict";

// Returns the model of an object, from the module of its API version.
function modelOf(object) {
  const folder = object.apiVersion === "v1" ? "v1" : object.apiVersion;
  let kinds;
  try {
    kinds = require(`kubernetes-models/${folder}`);
  } catch {
    throw new Error(`there is no API version ${object.apiVersion}`);
  }
  const model = Object.prototype.hasOwnProperty.call(kinds, object.kind) ? kinds[object.kind] : undefined;
  if (model === undefined || model.kind !== object.kind || model.apiVersion !== object.apiVersion)
    throw new Error(`there is no kind ${object.kind} in ${object.apiVersion}`);
  return model;
}

// Wraps an object or array so that `asked` gets the path of each field that is read.
function watched(value, path, asked) {
  if (value === null || typeof value !== "object") return value;
  return new Proxy(value, {
    get(target, name, receiver) {
      const field = Reflect.get(target, name, receiver);
      if (typeof name === "symbol" || !Object.prototype.hasOwnProperty.call(target, name)) return field;
      asked.add(`${path}/${name}`);
      return watched(field, `${path}/${name}`, asked);
    },
  });
}

// Returns the paths of all fields and items, but not those inside a field that was not asked for.
function unasked(value, path, asked) {
  if (value === null || typeof value !== "object") return [];
  return Object.keys(value).flatMap((name) => {
    const inside = `${path}/${name}`;
    return asked.has(inside) ? unasked(value[name], inside, asked) : [inside];
  });
}

function problemsOf(object) {
  const name = `${object.kind} ${object.metadata && object.metadata.name}`;
  try {
    const model = modelOf(object);
    new model(object).validate();
    const asked = new Set();
    model.prototype.validate.call(watched(object, "", asked));
    return unasked(object, "", asked).map((path) => `${name}: unknown field ${path}`);
  } catch (error) {
    return [`${name}: ${error.message}`];
  }
}

const input = JSON.parse(require("fs").readFileSync(0, "utf8"));
console.log(JSON.stringify(input.map((objects) => objects.flatMap(problemsOf))));
