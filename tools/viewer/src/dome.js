// Eye-dome lighting: depth alone makes edges dark, as in viewers of point clouds.

import { DepthTexture, FloatType, GLSL3, Mesh, NearestFilter, OrthographicCamera, PlaneGeometry, Scene, ShaderMaterial, Vector2, WebGLRenderTarget } from 'three';

const VERTEX = /* glsl */`
out vec2 vAt;
void main() { vAt = uv; gl_Position = vec4( position.xy, 0.0, 1.0 ); }`;

const FRAGMENT = /* glsl */`
layout(location = 0) out vec4 outColor;
in vec2 vAt;
uniform sampler2D uColor;
uniform highp sampler2D uDepth;
uniform vec2 uPixel;
uniform float uNear;
uniform float uFar;
uniform float uScale;
uniform int uParallel;
float distanceAt( vec2 at ) {
	float d = texture( uDepth, at ).r;
	if ( d >= 1.0 ) return uParallel == 1 ? 1e30 : uFar * 4.0;
	if ( uParallel == 1 ) return ( uNear + d * ( uFar - uNear ) );
	return uNear * uFar / ( uFar - d * ( uFar - uNear ) );
}
void main() {
	vec4 color = texture( uColor, vAt );
	float here = distanceAt( vAt );
	if ( texture( uDepth, vAt ).r >= 1.0 ) { outColor = color; return; }
	float sum = 0.0;
	for ( int k = 0; k < 8; k ++ ) {
		float angle = float( k ) * 0.7853981634;
		float there = distanceAt( vAt + vec2( cos( angle ), sin( angle ) ) * 1.4 * uPixel );
		// How far this place lies behind its neighbour, in parts of the distance.
		float behind = uParallel == 1 ? ( here - there ) / uScale : log2( here / there );
		sum += clamp( behind, 0.0, 0.016 );
	}
	outColor = vec4( color.rgb * exp( -sum * 13.0 ), color.a );
}`;

export class Dome {

	constructor( renderer ) {

		this.renderer = renderer;
		this.target = new WebGLRenderTarget( 1, 1, { samples: 4, minFilter: NearestFilter, magFilter: NearestFilter } );
		this.target.depthTexture = new DepthTexture( 1, 1, FloatType );
		this.material = new ShaderMaterial( {
			glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, depthTest: false, depthWrite: false,
			uniforms: {
				uColor: { value: this.target.texture }, uDepth: { value: this.target.depthTexture }, uPixel: { value: new Vector2() },
				uNear: { value: 0 }, uFar: { value: 1 }, uScale: { value: 1 }, uParallel: { value: 0 },
			},
		} );
		this.scene = new Scene();
		this.scene.add( new Mesh( new PlaneGeometry( 2, 2 ), this.material ) );
		this.camera = new OrthographicCamera( - 1, 1, 1, - 1, 0, 1 );

	}

	/** Draws what `paint` draws into a target; `height` is that of the view at its focus. */
	draw( paint, camera, height ) {

		const { renderer, target, material: { uniforms: u } } = this;
		const size = renderer.getDrawingBufferSize( new Vector2() );
		if ( target.width !== size.x || target.height !== size.y ) target.setSize( size.x, size.y );
		const ratio = renderer.getPixelRatio();
		u.uPixel.value.set( ratio / size.x, ratio / size.y );
		u.uNear.value = camera.near;
		u.uFar.value = camera.far;
		u.uScale.value = height;
		u.uParallel.value = camera.isOrthographicCamera ? 1 : 0;
		paint( target );
		renderer.setRenderTarget( null );
		renderer.render( this.scene, this.camera );

	}

}
