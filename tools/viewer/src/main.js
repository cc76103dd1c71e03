// The page: puts the parts together, and draws when something has changed.

import { ColorManagement, LinearSRGBColorSpace, Matrix4, Scene, WebGLRenderer } from 'three';
import { Dome } from './dome.js';
import { drawAxes, Marks, roundLength } from './marks.js';
import { plain } from './format.js';
import * as link from './link.js';
import { shared } from './material.js';
import { Navigator } from './navigator.js';
import { Fence, Pace, SLOW } from './pace.js';
import { Panel } from './panel.js';
import { Picker } from './picker.js';
import { Progress } from './progress.js';
import { watch } from './scene.js';
import { Section } from './section.js';
import { Split } from './split.js';
import { World } from './world.js';

// Colours are as on the screen, from file to canvas.
ColorManagement.enabled = false;

const GROUND = { light: 0xeef0f2, dark: 0x14171a };
const canvas = document.getElementById( 'canvas' );
const settings = { color: 'plain', edl: true, flat: false, backs: true, wire: false, boundary: false, detail: 1.5, budget: 1024 };

function start() {

	const renderer = new WebGLRenderer( { canvas, antialias: true, powerPreference: 'high-performance' } );
	renderer.outputColorSpace = LinearSRGBColorSpace;
	const sharp = Math.min( devicePixelRatio, 2 );
	renderer.setPixelRatio( sharp );
	const scene = new Scene(), dome = new Dome( renderer ), marks = new Marks(), section = new Section();
	const pace = new Pace(), fence = new Fence( renderer.getContext() );
	const progress = new Progress();
	let dirty = true, ready = false, frame = 0, coming = null, fitted = null;
	const changed = () => dirty = true;
	const split = new Split( changed );

	const navigator = new Navigator( canvas, {
		pick: ( x, y ) => ready ? picker.hit( x, y )?.point ?? null : null,
		bounds: () => mesh,
		changed,
		clicked: ( x, y ) => ready && picker.click( x, y ),
	} );
	const mesh = new World( renderer, navigator.camera, scene, { changed, failed, opened } );
	const picker = new Picker( { canvas, world: mesh, navigator, section, split, marks, changed } );
	/** The meshes that are in the picture. */
	const pictured = () => split.shown( mesh.open );

	// What can be done.

	const actions = {
		fit: () => navigator.fit(),
		view: name => navigator.view( name ),
		parallel() { navigator.go( { orthographic: ! navigator.orthographic } ); mesh.use( navigator.camera ); show(); },
		fly() { navigator.flying = ! navigator.flying; show(); },
		measure() { picker.measuring = ! picker.measuring; picker.clear(); show(); },
		link() { remember(); panel.copy( location.href ); },
		theme() { theme( document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark' ); },
		color( mode ) { settings.color = mode; mesh.colorBy( mode ); panel.legend( mode, mesh ); show(); remember(); },
		range( low, high ) { mesh.setRange( settings.color, low, high ); panel.legend( settings.color, mesh ); },
		toggle( name, on ) { settings[ name ] = on; apply(); },
		detail( detail ) { settings.detail = detail; mesh.set( { detail } ); },
		budget( budget ) { settings.budget = budget; mesh.set( { budget } ); },
		points( change ) { mesh.cloud.set( change ); show(); },
		section( axis ) {

			if ( axis && axis !== section.axis ) section.at = ( mesh.box.min[ axis ] + mesh.box.max[ axis ] ) / 2;
			section.axis = axis;
			show();
			changed();

		},
		sectionAt( part ) { const { min, max } = mesh.box, a = section.axis; section.at = min[ a ] + part * ( max[ a ] - min[ a ] ); show(); changed(); },
		sectionFlip() { section.side = - section.side; show(); changed(); },
	};
	const panel = picker.panel = new Panel( actions );
	const show = () => ready && panel.settings( { settings, navigator, section, mesh, measuring: picker.measuring } );

	function apply() {

		shared.uFlat.value = Number( settings.flat );
		shared.uBacks.value = Number( settings.backs );
		mesh.set( { wires: settings.wire, edges: settings.boundary } );
		show();
		changed();

	}

	function theme( name ) {

		document.documentElement.dataset.theme = name;
		renderer.setClearColor( GROUND[ name ], 1 );
		shared.uWire.value.set( 0x15181b );
		changed();

	}

	// Meshes and points come.

	/** The tree of a mesh is there, or, without one, the points are. */
	function opened( one ) {

		if ( one ) {

			const all = mesh.modes;
			actions.modes = all.map( ( [ mode ] ) => mode );
			panel.opened( mesh, all );
			mesh.colorBy( settings.color );
			const first = () => {

				one.tiles.removeEventListener( 'load-model', first );
				actions.color( settings.color );
				panel.loaded();

			};
			one.tiles.addEventListener( 'load-model', first );

		} else panel.points( mesh.cloud.info );
		if ( one === mesh.first ) {

			ready = true;
			settings.color = one.hasColors ? 'color' : 'plain';
			if ( ! restore() ) fit();
			apply();

		} else if ( ready ) {

			const name = one ? one.name : mesh.cloud.info.name, away = mesh.astray( one ? one.box : mesh.cloud.box );
			if ( away !== null ) panel.message( 'astray', `${ name } lies ${ plain( away, 0 ) } away from ${ mesh.first.name }: it may have other coordinates.` );

		}

		if ( one !== mesh.first && fitted === JSON.stringify( navigator.state() ) ) fit();
		show();
		changed();

	}

	/** Shows all that is there by now. */
	function fit() {

		navigator.view( 'oblique', false );
		fitted = JSON.stringify( navigator.state() );

	}

	watch( {
		known( all ) {

			const meshes = all.filter( part => part.kind === 'mesh' );
			if ( meshes.length > 1 ) split.name( meshes.map( part => part.name ) );
			restoreShown();

		},
		ready( part ) {

			if ( ! mesh.first ) panel.loading( null );
			mesh.add( part );

		},
		coming( others ) {

			coming = others;
			if ( ! mesh.first && others.length ) panel.loading( others.find( part => part.state === 'making' ) ?? others[ 0 ] );

		},
		failed( text ) {

			coming = [];
			if ( ready ) panel.message( 'ended', text );
			else panel.failed( text );

		},
	} );

	function failed( one, name, why ) {

		if ( ! one ) panel.message( 'points', `${ name }: ${ why }.` );
		else if ( ! name ) one === mesh.first ? panel.failed( why ) : panel.message( 'second', why );
		else {

			if ( one === mesh.first && one.missing.size && ! one.tiles.visibleTiles.size && one.missing.has( one.tiles.root ) ) panel.failed( `${ name } cannot be loaded; ${ why }.` );
			const more = one.missing.size > 1 ? ` (${ one.missing.size } tiles in all)` : '';
			panel.message( 'missing', `Tile ${ name } cannot be loaded${ more }; ${ why }.`, { action: { text: 'Try again', act: () => one.retry() } } );

		}

	}

	// Links.

	function restoreShown() {

		const { mode, at, points } = link.readShown( location.hash );
		split.set( mode );
		if ( at !== null ) split.move( at );
		mesh.cloud.set( points );

	}

	function restore() {

		const view = link.read( location.hash, mesh );
		if ( ! view ) return false;
		navigator.go( view.camera );
		mesh.use( navigator.camera );
		if ( view.section ) Object.assign( section, view.section );
		if ( actions.modes.includes( view.color ) ) settings.color = view.color;
		return true;

	}

	let written = '';
	function remember() {

		if ( ! ready ) return;
		written = link.write( { navigator, mesh, section, settings, split } );
		if ( written !== location.hash ) history.replaceState( null, '', written );

	}

	addEventListener( 'hashchange', () => {

		if ( ! ready || location.hash === written || ! restore() ) return;
		restoreShown();
		actions.color( settings.color );

	} );

	// Keys.

	const KEYS = {
		f: actions.fit, 0: () => actions.view( 'oblique' ), 1: () => actions.view( 'top' ), 2: () => actions.view( 'front' ), 3: () => actions.view( 'right' ),
		4: () => actions.view( 'left' ), 5: () => actions.view( 'back' ), 6: () => actions.view( 'bottom' ),
		o: actions.parallel, g: actions.fly, m: actions.measure, l: actions.link, n: actions.theme, v: () => split.next(), '[': () => split.nudge( - 1 ), ']': () => split.nudge( 1 ),
		p: () => actions.points( { on: ! mesh.cloud.on } ), '?': () => panel.help(), h: () => panel.help(),
		c: () => actions.color( actions.modes[ ( actions.modes.indexOf( settings.color ) + 1 ) % actions.modes.length ] ),
		...Object.fromEntries( [ [ 'e', 'edl' ], [ 't', 'flat' ], [ 'k', 'backs' ], [ 'x', 'wire' ], [ 'b', 'boundary' ] ].map( ( [ key, name ] ) => [ key, () => actions.toggle( name, ! settings[ name ] ) ] ) ),
		escape() { if ( picker.measuring && picker.isEmpty ) picker.measuring = false; if ( navigator.flying ) navigator.flying = false; picker.clear(); show(); },
	};
	addEventListener( 'keydown', event => {

		if ( ! ready || event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT|TEXTAREA)$/.test( event.target.tagName ) && event.target.type !== 'checkbox' && event.target.type !== 'range' ) return;
		const key = event.key.toLowerCase();
		const flies = navigator.flying && /^([wasdqe]|arrow.*|page.*|shift)$/.test( key );
		if ( flies ) {

			navigator.keys.add( key );
			if ( key !== 'shift' ) event.preventDefault();
			changed();

		} else if ( KEYS[ key ] && ! event.repeat ) KEYS[ key ]();

	} );

	// Drawing.

	let [ width, height, last, milliseconds, pointer ] = [ 0, 0, performance.now(), 0, null ];
	canvas.addEventListener( 'pointermove', event => pointer = event.buttons ? null : { x: event.offsetX, y: event.offsetY, at: performance.now() } );
	canvas.addEventListener( 'pointerleave', () => { pointer = null; panel.cursor( '' ); } );

	const seen = { view: new Matrix4(), projection: new Matrix4() };
	/** True if the camera is not where it was when this was asked the last time. */
	function moved() {

		const { matrixWorld, projectionMatrix } = navigator.camera;
		const same = seen.view.equals( matrixWorld ) && seen.projection.equals( projectionMatrix );
		seen.view.copy( matrixWorld );
		seen.projection.copy( projectionMatrix );
		return ! same;

	}

	/** Chooses the tiles for where the camera is. */
	function update( now ) {

		navigator.apply();
		if ( moved() ) pace.moved( now );
		mesh.update( navigator.camera, pace.coarser( now ) );

	}

	function draw( now ) {

		const ratio = sharp * pace.pixels( now );
		if ( renderer.getPixelRatio() !== ratio ) renderer.setPixelRatio( ratio );
		section.apply( navigator.camera );
		mesh.cloud.apply( ratio );
		const paint = target => split.paint( renderer, target, scene, navigator.camera, mesh.open );
		if ( settings.edl ) dome.draw( paint, navigator.camera, navigator.viewHeight() );
		else paint( null );
		marks.draw( navigator.camera, width, height );
		drawAxes( document.getElementById( 'axes' ), navigator );
		const pixel = navigator.pixel(), length = roundLength( 130 * pixel );
		panel.scale( length / pixel, length );
		fence.set( now, pace.moves( now ) );
		frame ++;

	}

	let busy = 0, paced = false, stale = true, limited = 0;
	function loop( now ) {

		requestAnimationFrame( loop );
		fence.poll( now, pace );
		if ( canvas.clientWidth !== width || canvas.clientHeight !== height ) {

			[ width, height ] = [ canvas.clientWidth, canvas.clientHeight ];
			renderer.setSize( width, height, false );
			changed();

		}

		const moves = navigator.advance( ( now - last ) / 1000 );
		last = now;
		// The view has come to rest: all detail again.
		if ( paced && ! pace.moves( now ) ) changed();
		// The renderer of tiles wants some frames after the last change, until nothing is on its way.
		if ( dirty || moves ) busy = 3;
		const loading = ! ready || mesh.isLoading;
		if ( busy > 0 || loading ) {

			busy --;
			dirty = false;
			stale = true;
			update( now );

		}

		paced = pace.moves( now );
		// Pictures do not queue up, so that the next one has the camera as it is then.
		if ( ! stale || fence.pending( now ) > SLOW || ! pace.due( now, loading ) ) return;
		const began = performance.now();
		stale = false;
		draw( now );
		milliseconds += 0.2 * ( performance.now() - began - milliseconds );

	}

	setInterval( () => {

		if ( ! ready ) return;
		const now = performance.now(), stats = mesh.stats( pictured() ), moves = pace.moves( now );
		panel.stats( { ...stats, coarser: Math.max( stats.coarser, pace.coarser( now ) ) }, pictured(), milliseconds );
		progress.show( coming ?? [], stats.loading, mesh.cloud.loading, now );
		// While the view moves, the pace decides. One change for each picture, which shows what it did.
		if ( ! moves && frame !== limited ) mesh.limit( stats.triangles );
		limited = frame;
		if ( ! navigator.moving && ! navigator.pointers.size ) remember();

	}, 250 );
	setInterval( () => {

		if ( ! pointer || ! ready || performance.now() - pointer.at < 60 || pointer.told ) return;
		pointer.told = true;
		panel.cursor( picker.coordinates( pointer.x, pointer.y ) );

	}, 60 );

	theme( matchMedia( '(prefers-color-scheme: dark)' ).matches ? 'dark' : 'light' );
	canvas.addEventListener( 'webglcontextlost', event => { event.preventDefault(); panel.message( 'lost', 'The graphics were reset. Reload the page to go on.' ); } );
	requestAnimationFrame( loop );

	// For tests and for those who drive the page by a program.
	window.outcropViewer = {
		world: mesh, navigator, actions, settings, section, pace, split,
		/** The first mesh. */
		get mesh() { return mesh.first; },
		get ready() { return ready; },
		get frame() { return frame; },
		/** Time that the page itself takes for a picture, without that of the graphics, in ms. */
		get milliseconds() { return milliseconds; },
		/** True if nothing is loading and the last change is drawn. */
		get settled() { return ready && ! dirty && ! stale && busy <= 0 && ! navigator.moving && ! paced && coming?.length === 0 && ! mesh.isLoading && mesh.stats( pictured() ).loading === 0; },
		/** What is drawn, as a PNG in a URL. */
		picture() { const now = performance.now(); update( now ); draw( now ); return canvas.toDataURL(); },
		stats: () => mesh.stats( pictured() ), vertexAt: ( x, y ) => picker.vertexAt( x, y ), hit: ( x, y ) => picker.hit( x, y ), click: ( x, y ) => picker.click( x, y ), redraw: changed, use: () => mesh.use( navigator.camera ),
		get measured() { return picker.lengths; },
	};

}

try {

	start();

} catch ( error ) {

	const box = document.getElementById( 'loading' );
	box.classList.add( 'failed' );
	box.querySelector( 'p' ).textContent = /webgl/i.test( String( error ) ) ? 'This browser has no WebGL 2, which the viewer needs.' : `The viewer cannot start: ${ error }`;
	console.error( error );

}
