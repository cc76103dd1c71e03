// The materials of tiles. Colours are as on the screen throughout: no conversions by the renderer.

import { Color, DoubleSide, GLSL3, ShaderMaterial, Vector3, Vector4 } from 'three';
import { SIGNED } from './ramps.js';

/** Ways to colour the mesh; the numbers are those in the shader. Values that are no numbers are grey. */
export const MODES = { plain: 0, color: 1, value: 2, height: 3, tile: 4, level: 4, class: 5, signed: 6 };

/** Values that all tiles of all meshes share. */
export const shared = {
	uFlat: { value: 0 },
	uBacks: { value: 1 },
	uBack: { value: new Color( 0.33, 0.52, 0.80 ) },
	uRamp: { value: null },
	uClasses: { value: null },
	uRange: { value: new Vector4( 0, 1, 0, 0 ) },
	uUp: { value: new Vector3( 0, 0, 1 ) },
	uCut: { value: new Vector4( 0, 0, 0, 0 ) },
	uLine: { value: new Color( 0.86, 0.16, 0.12 ) },
	uWire: { value: new Color( 0.08, 0.09, 0.1 ) },
};

/** The diameter of points in pixels, and whether they have their own colours. */
export const pointSize = { value: 2 }, pointStyle = { value: 1 };
const pointPlain = { value: new Color( 0.10, 0.42, 0.70 ) };

/** From linear light to what the screen shows. */
const ENCODED = /* glsl */`
vec3 encoded( vec3 c ) {
	return mix( 12.92 * c, 1.055 * pow( max( c, 0.0 ), vec3( 1.0 / 2.4 ) ) - 0.055, step( 0.0031308, c ) );
}`;

const VERTEX = /* glsl */`
in float value;
uniform float uShift;
uniform vec3 uUp;
out vec3 vView;
out vec3 vNormal;
out vec3 vColor;
out float vValue;
out float vHeight;
uniform float uLow;
void main() {
	vec4 view = modelViewMatrix * vec4( position, 1.0 );
	vView = view.xyz;
	vNormal = normalMatrix * normal;
	#ifdef USE_COLOR
		vColor = color;
	#else
		vColor = vec3( 0.7 );
	#endif
	vValue = value + uShift;
	// The height above that of the tile, so that single precision suffices.
	vHeight = mat3( modelMatrix )[0].z * position.x + mat3( modelMatrix )[1].z * position.y + mat3( modelMatrix )[2].z * position.z + uLow;
	gl_Position = projectionMatrix * view;
}`;

const CUT = /* glsl */`
uniform vec4 uCut;
in vec3 vView;
void cut() {
	if ( dot( uCut.xyz, vView ) + uCut.w < 0.0 ) discard;
}`;

/** A colour in the shader. */
const vec3 = hex => `vec3( ${ [ 0, 2, 4 ].map( at => ( parseInt( hex.slice( at, at + 2 ), 16 ) / 255 ).toFixed( 4 ) ).join( ', ' ) } )`;

const FRAGMENT = /* glsl */`
layout(location = 0) out vec4 outColor;
${ CUT }
in vec3 vNormal;
in vec3 vColor;
in float vValue;
in float vHeight;
uniform int uMode;
uniform int uFlat;
uniform int uBacks;
uniform vec3 uFront;
uniform vec3 uBack;
uniform vec3 uTile;
uniform vec4 uRange;
uniform sampler2D uRamp;
uniform sampler2D uClasses;
${ ENCODED }
vec3 ramp( float x ) {
	float t = clamp( ( x - uRange.x ) / max( uRange.y - uRange.x, 1e-30 ), 0.0, 1.0 );
	return texture( uRamp, vec2( t * 255.0 / 256.0 + 0.5 / 256.0, 0.5 ) ).rgb;
}
// Blue below the middle, red above it.
vec3 signedRamp( float x ) {
	float t = clamp( 2.0 * ( x - uRange.x ) / max( uRange.y - uRange.x, 1e-30 ) - 1.0, -1.0, 1.0 );
	return mix( ${ vec3( SIGNED[ 1 ] ) }, t < 0.0 ? ${ vec3( SIGNED[ 0 ] ) } : ${ vec3( SIGNED[ 2 ] ) }, abs( t ) );
}
void main() {
	cut();
	vec3 face = normalize( cross( dFdx( vView ), dFdy( vView ) ) );
	vec3 n = uFlat == 1 || dot( vNormal, vNormal ) < 1e-12 ? face : normalize( vNormal );
	// The side that is seen is lit, whichever way the triangle runs.
	if ( dot( n, face ) < 0.0 ) n = -n;
	vec3 base = uFront;
	if ( uMode == 1 ) base = encoded( vColor );
	else if ( uMode == 2 ) base = isnan( vValue ) ? vec3( 0.55 ) : ramp( vValue );
	else if ( uMode == 6 ) base = isnan( vValue ) ? vec3( 0.55 ) : signedRamp( vValue );
	else if ( uMode == 3 ) base = ramp( vHeight );
	else if ( uMode == 4 ) base = uTile;
	else if ( uMode == 5 ) base = texture( uClasses, vec2( ( floor( vValue + 0.5 ) + 0.5 ) / 256.0, 0.5 ) ).rgb;
	if ( uBacks == 1 && ! gl_FrontFacing ) base = mix( uBack, base, 0.12 );
	// A light at the viewer's upper left, and a weak one from the right.
	float key = max( dot( n, normalize( vec3( -0.45, 0.65, 0.75 ) ) ), 0.0 );
	float fill = max( dot( n, normalize( vec3( 0.8, -0.1, 0.55 ) ) ), 0.0 );
	float light = 0.34 + 0.62 * key + 0.16 * fill;
	if ( uMode != 0 ) light = mix( 1.0, light, 0.72 );
	outColor = vec4( min( base * light, 1.0 ), 1.0 );
}`;

/** The place of a line or point: a little nearer than its triangles, at the same place of the picture. */
const NEARER = /* glsl */`
out vec3 vView;
uniform float uNear;
void place() {
	vec4 view = modelViewMatrix * vec4( position, 1.0 );
	vView = view.xyz;
	if ( projectionMatrix[3][3] == 1.0 ) view.z += uNear * 2.0 / projectionMatrix[1][1];
	else view.xyz *= 1.0 - uNear;
	gl_Position = projectionMatrix * view;
}`;

const LINE_VERTEX = /* glsl */`
${ NEARER }
void main() { place(); }`;

const LINE_FRAGMENT = /* glsl */`
layout(location = 0) out vec4 outColor;
${ CUT }
uniform vec3 uColor;
uniform float uOpacity;
void main() {
	cut();
	outColor = vec4( uColor, uOpacity );
}`;

const POINT_VERTEX = /* glsl */`
${ NEARER }
uniform float uSize;
out vec3 vColor;
void main() {
	place();
	#ifdef USE_COLOR
		vColor = color;
	#else
		vColor = vec3( 0.0 );
	#endif
	gl_PointSize = uSize;
}`;

const POINT_FRAGMENT = /* glsl */`
layout(location = 0) out vec4 outColor;
${ CUT }
${ ENCODED }
in vec3 vColor;
uniform float uSize;
uniform float uStyle;
uniform vec3 uPlain;
void main() {
	cut();
	// Small ones stay square: of a round one of two pixels nothing would be left.
	vec2 from = gl_PointCoord - 0.5;
	if ( uSize > 3.0 && dot( from, from ) > 0.25 ) discard;
	outColor = vec4( uStyle > 0.5 ? encoded( vColor ) : uPlain, 1.0 );
}`;

/**
 * The material of a tile's triangles. `low` is the tile's lowest place in height, `color` that of the tile, and `own`
 * has the values of its mesh.
 */
export function surface( colors, low, color, own ) {

	return new ShaderMaterial( {
		glslVersion: GLSL3,
		vertexShader: VERTEX,
		fragmentShader: FRAGMENT,
		uniforms: { ...shared, ...own, uLow: { value: low }, uTile: { value: color } },
		vertexColors: colors,
		side: DoubleSide,
	} );

}

function lines( color, opacity, near, wireframe ) {

	return new ShaderMaterial( {
		glslVersion: GLSL3,
		vertexShader: LINE_VERTEX,
		fragmentShader: LINE_FRAGMENT,
		uniforms: { uCut: shared.uCut, uColor: color, uOpacity: { value: opacity }, uNear: { value: near } },
		transparent: opacity < 1,
		depthWrite: opacity >= 1,
		side: DoubleSide,
		wireframe,
	} );

}

/** The material of boundary edges. */
export const boundary = () => lines( shared.uLine, 1, 8e-4, false );

/** The material of the edges of all triangles. */
export const wire = () => lines( shared.uWire, 0.35, 4e-4, true );

/** The material of points. */
export function points( colors ) {

	return new ShaderMaterial( {
		glslVersion: GLSL3,
		vertexShader: POINT_VERTEX,
		fragmentShader: POINT_FRAGMENT,
		uniforms: { uCut: shared.uCut, uSize: pointSize, uStyle: pointStyle, uPlain: pointPlain, uNear: { value: 6e-4 } },
		vertexColors: colors,
	} );

}
