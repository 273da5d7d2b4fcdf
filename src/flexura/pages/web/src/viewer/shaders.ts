// Vertices are numbered; where they are, and what they move by, is read from textures, so that a motion is shown by
// naming another texture, and faces, lines and dots share one set of points.

export const WIDTH = 2048; // texels in a row of every table

const COMMON = /* glsl */ `
precision highp float;
precision highp int;
precision highp sampler2D;
uniform mat4 viewMatrix;
uniform mat4 projectionMatrix;
uniform sampler2D points;  // place, number of the part
uniform sampler2D fieldA;  // displacement, share of the largest value (below 0: unknown)
uniform sampler2D fieldB;
uniform float mixing;      // from field A to field B
uniform float scale;
uniform sampler2D looks;   // colour and opacity of parts
ivec2 texel(int k) { return ivec2(k % ${WIDTH}, k / ${WIDTH}); }
vec4 field(int k) {
  vec4 a = texelFetch(fieldA, texel(k), 0), b = texelFetch(fieldB, texel(k), 0);
  return vec4(mix(a.xyz, b.xyz, mixing), min(a.w, b.w) < 0.0 ? -1.0 : mix(a.w, b.w, mixing));
}
vec4 look(int part) { return texelFetch(looks, texel(part), 0); }
`;

const FRAGMENT = /* glsl */ `
precision highp float;
precision highp int;
uniform bool picking;
uniform vec4 plane;        // what lies beyond it is cut away
uniform int hovered;
uniform int selected;
uniform vec3 accent;
out vec4 colour;
vec4 numbered(int part) {
  int n = part + 1;
  return vec4(float(n & 255), float((n >> 8) & 255), float((n >> 16) & 255), 255.0) / 255.0;
}
vec3 linear(vec3 c) { return c * c * (0.3 * c + 0.7); }
vec3 shown(vec3 c) { return pow(clamp(c, 0.0, 1.0), vec3(1.0 / 2.2)); }
`;

export const FACES = {
  vertex: /* glsl */ `${COMMON}
flat out int part;
out vec3 inView;
out vec3 inWorld;
out vec2 value;            // share, and whether it is known
out vec4 look_;
void main() {
  vec4 p = texelFetch(points, texel(gl_VertexID), 0), f = field(gl_VertexID);
  part = int(p.w + 0.5);
  inWorld = p.xyz + scale * f.xyz;
  vec4 v = viewMatrix * vec4(inWorld, 1.0);
  inView = v.xyz;
  value = vec2(max(f.w, 0.0), f.w < 0.0 ? 0.0 : 1.0);
  look_ = look(part);
  gl_Position = projectionMatrix * v;
}`,
  fragment: /* glsl */ `${FRAGMENT}
uniform bool byValue;
uniform sampler2D map;
uniform vec3 unknown;
uniform vec3 upward;       // world's up in view
uniform vec3 cutColour;
flat in int part;
in vec3 inView;
in vec3 inWorld;
in vec2 value;
in vec4 look_;
void main() {
  if (dot(plane.xyz, inWorld) > plane.w) discard;
  if (picking) { colour = numbered(part); return; }
  vec3 n = normalize(cross(dFdx(inView), dFdy(inView)));
  vec3 base = look_.rgb;
  if (byValue) base = value.y < 0.999 ? unknown : texture(map, vec2((value.x * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  if (!gl_FrontFacing && plane.w < 1e5) {
    float stripe = step(0.5, fract((gl_FragCoord.x + gl_FragCoord.y) / 9.0));
    colour = vec4(mix(mix(base, cutColour, 0.55), mix(base, cutColour, 0.3), stripe), 1.0);
    return;
  }
  float key = max(dot(n, normalize(vec3(-0.4, 0.55, 0.75))), 0.0);
  float fill = max(dot(n, normalize(vec3(0.8, -0.1, 0.45))), 0.0);
  float sky = 0.5 + 0.5 * dot(n, upward);
  float rim = pow(1.0 - clamp(n.z, 0.0, 1.0), 3.0);
  float light = 0.34 + 0.22 * sky + 0.46 * key + 0.20 * fill;
  if (byValue) light = mix(light, 0.97, 0.55);
  vec3 lit = linear(base) * light + 0.03 * rim;
  lit += (byValue ? 0.0 : 0.05) * pow(max(dot(n, normalize(vec3(-0.22, 0.32, 0.92))), 0.0), 40.0);
  if (part == selected) lit = mix(lit, linear(accent), 0.30);
  if (part == hovered) lit = mix(lit, vec3(1.0), 0.16);
  colour = vec4(shown(lit), look_.a);
}`,
};

/** Feature edges, one device pixel wide. */
export const EDGES = {
  vertex: /* glsl */ `${COMMON}
out vec3 inWorld;
void main() {
  vec4 p = texelFetch(points, texel(gl_VertexID), 0);
  inWorld = p.xyz + scale * field(gl_VertexID).xyz;
  gl_Position = projectionMatrix * viewMatrix * vec4(inWorld, 1.0);
  gl_Position.z -= 2e-5 * gl_Position.w;
}`,
  fragment: /* glsl */ `${FRAGMENT}
uniform vec4 ink;
in vec3 inWorld;
void main() {
  if (dot(plane.xyz, inWorld) > plane.w) discard;
  colour = ink;
}`,
};

/** Lines of a width in pixels: a quad for each, set up from the numbers of its two ends. */
export const LINES = {
  vertex: /* glsl */ `${COMMON}
in vec2 corner;
in vec2 ends;
uniform vec2 pixels;       // of the picture
uniform float width;       // CSS pixels
uniform float ratio;       // pixels of the picture to one of CSS
uniform float nearer;
flat out int part;
out vec3 inWorld;
out vec2 value;
out vec3 own;
vec4 projected(int k, out vec3 world, out float share) {
  vec4 p = texelFetch(points, texel(k), 0), f = field(k);
  world = p.xyz + scale * f.xyz;
  share = f.w;
  return projectionMatrix * viewMatrix * vec4(world, 1.0);
}
void main() {
  vec3 worldA, worldB;
  float shareA, shareB;
  int k = int(ends.x + 0.5);
  vec4 a = projected(k, worldA, shareA), b = projected(int(ends.y + 0.5), worldB, shareB);
  part = int(texelFetch(points, texel(k), 0).w + 0.5);
  if (a.w < 1e-4) a = mix(a, b, (1e-4 - a.w) / max(b.w - a.w, 1e-9));
  if (b.w < 1e-4) b = mix(b, a, (1e-4 - b.w) / max(a.w - b.w, 1e-9));
  vec2 along = (b.xy / b.w - a.xy / a.w) * pixels;
  along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  bool second = corner.x > 0.5;
  vec4 p = second ? b : a;
  vec2 shift = (vec2(-along.y, along.x) * corner.y + along * (second ? 1.0 : -1.0)) * width * ratio;
  p.xy += shift * p.w / pixels;
  p.z -= nearer * p.w;
  gl_Position = p;
  inWorld = second ? worldB : worldA;
  float share = second ? shareB : shareA;
  value = vec2(max(share, 0.0), share < 0.0 ? 0.0 : 1.0);
  own = look(part).rgb;
}`,
  fragment: /* glsl */ `${FRAGMENT}
uniform bool byValue;
uniform sampler2D map;
uniform vec4 ink;          // of all lines; alpha 0: their parts' own
flat in int part;
in vec3 inWorld;
in vec2 value;
in vec3 own;
void main() {
  if (dot(plane.xyz, inWorld) > plane.w) discard;
  if (picking) { colour = numbered(part); return; }
  vec3 c = own;
  if (byValue && value.y > 0.999) c = texture(map, vec2((value.x * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  if (ink.a > 0.0) c = ink.rgb;
  else if (part == selected) c = mix(c, accent, 0.8);
  else if (part == hovered) c = mix(c, vec3(1.0), 0.35);
  colour = vec4(c, ink.a > 0.0 ? ink.a : 1.0);
}`,
};

export const DOTS = {
  vertex: /* glsl */ `${COMMON}
uniform float diameter;
flat out int part;
out vec3 inWorld;
out vec3 own;
void main() {
  vec4 p = texelFetch(points, texel(gl_VertexID), 0);
  part = int(p.w + 0.5);
  inWorld = p.xyz + scale * field(gl_VertexID).xyz;
  own = look(part).rgb;
  gl_Position = projectionMatrix * viewMatrix * vec4(inWorld, 1.0);
  gl_Position.z -= 5e-5 * gl_Position.w;
  gl_PointSize = diameter;
}`,
  fragment: /* glsl */ `${FRAGMENT}
uniform vec4 ink;
flat in int part;
in vec3 inWorld;
in vec3 own;
void main() {
  float r = 2.0 * length(gl_PointCoord - 0.5);
  if (r > 1.0 || dot(plane.xyz, inWorld) > plane.w) discard;
  if (picking) { colour = numbered(part); return; }
  vec3 c = part == selected ? accent : part == hovered ? mix(own, vec3(1.0), 0.35) : own;
  colour = vec4(r > 0.72 ? ink.rgb : c, 1.0);
}`,
};
