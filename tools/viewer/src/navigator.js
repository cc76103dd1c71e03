// The camera: where it is, and how pointer, wheel and keys move it. Up is always z.

import { MathUtils, OrthographicCamera, PerspectiveCamera, Vector3 } from 'three';

const UP = new Vector3( 0, 0, 1 );
const STEEPEST = Math.PI / 2;

/** Time of a move to another view, in ms. */
const MOVE = 350;

/** Directions of view by name, as degrees: azimuth of where the camera looks, elevation of the same. */
export const VIEWS = {
	top: [ 90, - 90 ], bottom: [ 90, 90 ], front: [ 90, 0 ], back: [ - 90, 0 ], right: [ 180, 0 ], left: [ 0, 0 ], oblique: [ 130, - 32 ],
};

export class Navigator {

	/** `pick` gives the point of the mesh at a pixel, or null; `bounds` the mesh's sphere; `changed` is told of moves. */
	constructor( canvas, { pick, bounds, changed, clicked } ) {

		Object.assign( this, { canvas, pick, bounds, changed, clicked } );
		this.perspective = new PerspectiveCamera( 45, 1, 1, 1000 );
		this.parallel = new OrthographicCamera();
		for ( const camera of [ this.perspective, this.parallel ] ) camera.up.copy( UP );
		this.orthographic = false;
		this.flying = false;
		this.focus = new Vector3();
		this.distance = 10;
		this.yaw = MathUtils.degToRad( 130 );
		this.pitch = MathUtils.degToRad( - 32 );
		this.keys = new Set();
		this.pointers = new Map();
		this.moving = null;
		this.#listen();

	}

	get camera() { return this.orthographic ? this.parallel : this.perspective; }

	/** Where the camera looks. */
	direction() {

		const c = Math.cos( this.pitch );
		return new Vector3( Math.cos( this.yaw ) * c, Math.sin( this.yaw ) * c, Math.sin( this.pitch ) );

	}

	right() { return new Vector3( Math.sin( this.yaw ), - Math.cos( this.yaw ), 0 ); }

	up() { return this.right().cross( this.direction() ); }

	position() { return this.focus.clone().addScaledVector( this.direction(), - this.distance ); }

	/** Height of the view in the plane of the focus. */
	viewHeight( depth = this.distance ) {

		return 2 * Math.tan( MathUtils.degToRad( this.perspective.fov ) / 2 ) * ( this.orthographic ? this.distance : depth );

	}

	/** Size of a pixel at the focus. */
	pixel() { return this.viewHeight() / this.canvas.clientHeight; }

	state() {

		const { focus, distance, yaw, pitch, orthographic } = this;
		return { focus: focus.clone(), distance, yaw, pitch, orthographic };

	}

	/** Takes a view at once, or moves there. */
	go( to, smooth = false ) {

		const target = { ...this.state(), ...to };
		target.pitch = MathUtils.clamp( target.pitch, - STEEPEST, STEEPEST );
		this.orthographic = target.orthographic;
		if ( smooth && ! matchMedia( '(prefers-reduced-motion: reduce)' ).matches ) {

			const turn = MathUtils.euclideanModulo( target.yaw - this.yaw + Math.PI, 2 * Math.PI ) - Math.PI;
			this.moving = { from: this.state(), to: { ...target, yaw: this.yaw + turn }, since: performance.now() };

		} else {

			this.moving = null;
			Object.assign( this, target, { focus: target.focus.clone() } );

		}

		this.changed();

	}

	/** A direction that shows the whole mesh. */
	view( name, smooth = true ) {

		const [ azimuth, elevation ] = VIEWS[ name ];
		this.fit( { yaw: MathUtils.degToRad( azimuth ), pitch: MathUtils.degToRad( elevation ) }, smooth );

	}

	/** Shows the whole mesh from where the camera looks. */
	fit( direction = {}, smooth = true ) {

		const { min, max } = this.bounds().box;
		const wanted = { yaw: this.yaw, pitch: this.pitch, ...direction };
		const c = Math.cos( wanted.pitch );
		const ahead = new Vector3( Math.cos( wanted.yaw ) * c, Math.sin( wanted.yaw ) * c, Math.sin( wanted.pitch ) );
		const right = new Vector3( Math.sin( wanted.yaw ), - Math.cos( wanted.yaw ), 0 );
		const up = right.clone().cross( ahead );
		const center = min.clone().add( max ).multiplyScalar( 0.5 );
		const half = max.clone().sub( min ).multiplyScalar( 0.5 );
		const tan = Math.tan( MathUtils.degToRad( this.perspective.fov ) / 2 );
		const aspect = this.canvas.clientWidth / this.canvas.clientHeight;
		// The least distance at which every corner of the box is in the picture.
		let distance = 1e-6;
		for ( let corner = 0; corner < 8; corner ++ ) {

			const at = new Vector3( ...[ 'x', 'y', 'z' ].map( ( axis, k ) => half[ axis ] * ( corner >> k & 1 ? 1 : - 1 ) ) );
			const aside = Math.max( Math.abs( at.dot( up ) ), Math.abs( at.dot( right ) ) / aspect );
			distance = Math.max( distance, 1.04 * aside / tan - ( this.orthographic ? 0 : at.dot( ahead ) ) );

		}

		this.go( { ...wanted, focus: center, distance }, smooth );

	}

	/** One frame. Returns true if the camera moves by itself. */
	advance( seconds ) {

		if ( this.moving ) {

			const { from, to, since } = this.moving;
			const t = Math.min( ( performance.now() - since ) / MOVE, 1 ), s = t * t * ( 3 - 2 * t );
			this.focus.lerpVectors( from.focus, to.focus, s );
			this.distance = from.distance * ( to.distance / from.distance ) ** s;
			this.yaw = MathUtils.lerp( from.yaw, to.yaw, s );
			this.pitch = MathUtils.lerp( from.pitch, to.pitch, s );
			if ( t === 1 ) this.moving = null;
			this.changed();
			return true;

		}

		return this.flying && this.#fly( seconds );

	}

	#fly( seconds ) {

		const held = ( ...keys ) => keys.some( key => this.keys.has( key ) ) ? 1 : 0;
		const ahead = held( 'w', 'arrowup' ) - held( 's', 'arrowdown' );
		const aside = held( 'd', 'arrowright' ) - held( 'a', 'arrowleft' );
		const above = held( 'e', 'pageup' ) - held( 'q', 'pagedown' );
		if ( ! ahead && ! aside && ! above ) return false;
		const way = this.distance * 0.7 * ( this.keys.has( 'shift' ) ? 4 : 1 ) * Math.min( seconds, 0.1 );
		this.focus.addScaledVector( this.direction(), ahead * way ).addScaledVector( this.right(), aside * way ).addScaledVector( UP, above * way );
		this.changed();
		return true;

	}

	/** Brings the camera's matrices up to date. Near and far planes enclose the mesh. */
	apply() {

		const { camera, canvas } = this, { center, radius } = this.bounds().sphere;
		const aspect = canvas.clientWidth / canvas.clientHeight || 1;
		const position = this.position();
		camera.position.copy( position );
		// A direction straight up or down has no place for z: the matrix is made of the three axes.
		camera.matrix.makeBasis( this.right(), this.up(), this.direction().negate() ).setPosition( position );
		camera.matrix.decompose( camera.position, camera.quaternion, camera.scale );
		const depth = center.clone().sub( position ).dot( this.direction() );
		if ( this.orthographic ) {

			const half = this.viewHeight() / 2;
			Object.assign( camera, { top: half, bottom: - half, left: - half * aspect, right: half * aspect, near: depth - 1.1 * radius, far: depth + 1.1 * radius } );

		} else {

			const far = Math.max( position.distanceTo( center ) + 1.05 * radius, 1e-3 * radius );
			const outside = Math.max( position.distanceTo( center ) - 1.05 * radius, 0 );
			Object.assign( camera, { aspect, far, near: Math.max( outside, Math.min( 0.005 * this.distance, 0.1 * far ), 1e-5 * far ) } );

		}

		camera.updateProjectionMatrix();
		camera.updateMatrixWorld( true );

	}

	// Input.

	/** The point to turn or zoom around at a pixel: on the mesh, else in the plane of the focus. */
	#anchor( x, y ) {

		const hit = this.pick( x, y );
		if ( hit ) return hit;
		const { width, height } = this.canvas.getBoundingClientRect();
		const tall = this.viewHeight();
		return this.focus.clone()
			.addScaledVector( this.right(), ( x / width - 0.5 ) * tall * width / height )
			.addScaledVector( this.up(), ( 0.5 - y / height ) * tall );

	}

	#turn( dx, dy, pivot ) {

		const speed = Math.PI / this.canvas.clientHeight;
		const pitch = MathUtils.clamp( this.pitch - dy * speed, - STEEPEST, STEEPEST );
		const [ yawing, pitching ] = [ - dx * speed, pitch - this.pitch ];
		const from = this.position().sub( pivot );
		from.applyAxisAngle( this.right(), pitching ).applyAxisAngle( UP, yawing );
		this.yaw += yawing;
		this.pitch = pitch;
		this.focus.copy( pivot ).add( from ).addScaledVector( this.direction(), this.distance );

	}

	#look( dx, dy ) {

		const speed = MathUtils.degToRad( this.perspective.fov ) / this.canvas.clientHeight;
		const position = this.position();
		this.yaw -= dx * speed;
		this.pitch = MathUtils.clamp( this.pitch - dy * speed, - STEEPEST, STEEPEST );
		this.focus.copy( position ).addScaledVector( this.direction(), this.distance );

	}

	#shift( dx, dy, pivot ) {

		const depth = pivot.clone().sub( this.position() ).dot( this.direction() );
		const size = this.viewHeight( Math.max( depth, 1e-3 * this.distance ) ) / this.canvas.clientHeight;
		this.focus.addScaledVector( this.right(), - dx * size ).addScaledVector( this.up(), dy * size );

	}

	/** Zooms towards a point, which stays where it is on the screen. */
	zoom( factor, pivot = this.focus.clone() ) {

		const least = 1e-6 * this.bounds().sphere.radius, most = 50 * this.bounds().sphere.radius;
		const depth = pivot.clone().sub( this.position() ).dot( this.direction() );
		if ( this.orthographic ) {

			factor = MathUtils.clamp( this.distance * factor, least, most ) / this.distance;
			this.focus.sub( pivot ).multiplyScalar( factor ).add( pivot );
			this.distance *= factor;

		} else {

			if ( ! ( depth > 0 ) ) return;
			factor = MathUtils.clamp( depth * factor, least, most ) / depth;
			const position = this.position().sub( pivot ).multiplyScalar( factor ).add( pivot );
			this.distance = depth * factor;
			this.focus.copy( position ).addScaledVector( this.direction(), this.distance );

		}

		this.changed();

	}

	#listen() {

		const { canvas, pointers } = this;
		const at = event => {

			const { left, top } = canvas.getBoundingClientRect();
			return { x: event.clientX - left, y: event.clientY - top };

		};
		canvas.addEventListener( 'contextmenu', event => event.preventDefault() );
		canvas.addEventListener( 'pointerdown', event => {

			canvas.focus( { preventScroll: true } );
			try { canvas.setPointerCapture( event.pointerId ); } catch { /* an event made by a script has no pointer */ }
			this.moving = null;
			const place = at( event );
			pointers.set( event.pointerId, { ...place, button: event.button, start: place } );
			this.drag = { pivot: this.#anchor( place.x, place.y ), moved: false, shift: event.button !== 0 || event.shiftKey };

		} );
		canvas.addEventListener( 'pointermove', event => {

			const pointer = pointers.get( event.pointerId );
			if ( pointer ) this.#dragged( pointer, at( event ) );

		} );
		const ended = event => {

			const pointer = pointers.get( event.pointerId );
			pointers.delete( event.pointerId );
			if ( pointer && ! this.drag?.moved && event.type === 'pointerup' && pointer.button === 0 ) this.clicked( pointer.x, pointer.y, event );

		};
		canvas.addEventListener( 'pointerup', ended );
		canvas.addEventListener( 'pointercancel', ended );
		canvas.addEventListener( 'dblclick', event => {

			const { x, y } = at( event ), hit = this.pick( x, y );
			if ( hit ) this.go( { focus: hit, distance: hit.clone().sub( this.position() ).dot( this.direction() ) * 0.5 }, true );

		} );
		canvas.addEventListener( 'wheel', event => {

			event.preventDefault();
			this.moving = null;
			const { x, y } = at( event ), steps = event.deltaY * ( event.deltaMode === 1 ? 16 : 1 );
			// One search for a series of events at one place.
			const now = performance.now();
			if ( ! ( this.wheel && now - this.wheel.time < 300 && Math.hypot( x - this.wheel.x, y - this.wheel.y ) < 3 ) ) this.wheel = { pivot: this.#anchor( x, y ), x, y };
			this.wheel.time = now;
			this.zoom( Math.exp( MathUtils.clamp( steps, - 240, 240 ) * 0.0016 ), this.wheel.pivot );

		}, { passive: false } );
		addEventListener( 'keyup', event => this.keys.delete( event.key.toLowerCase() ) );
		addEventListener( 'blur', () => this.keys.clear() );

	}

	#dragged( pointer, place ) {

		const [ dx, dy ] = [ place.x - pointer.x, place.y - pointer.y ];
		const far = Math.hypot( place.x - pointer.start.x, place.y - pointer.start.y ) > 3;
		if ( ! this.drag.moved && ! far ) return;
		const all = [ ...this.pointers.values() ];
		const spread = () => all.length === 2 ? Math.hypot( all[ 0 ].x - all[ 1 ].x, all[ 0 ].y - all[ 1 ].y ) : 0;
		const before = spread();
		this.drag.moved = true;
		Object.assign( pointer, place );
		if ( all.length === 2 ) {

			this.#shift( dx / 2, dy / 2, this.drag.pivot );
			if ( before > 0 && spread() > 0 ) this.zoom( before / spread(), this.drag.pivot );

		} else if ( this.drag.shift ) this.#shift( dx, dy, this.drag.pivot );
		else if ( this.flying ) this.#look( dx, dy );
		else this.#turn( dx, dy, this.drag.pivot );
		this.changed();

	}

}
