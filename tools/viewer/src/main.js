// The page: puts the parts together, and draws when something has changed.

import { ColorManagement, LinearSRGBColorSpace, Matrix4, Raycaster, Scene, Vector2, Vector3, WebGLRenderer } from 'three';
import { Dome } from './dome.js';
import { drawAxes, Marks, roundLength } from './marks.js';
import * as link from './link.js';
import { shared } from './material.js';
import { MeshView } from './mesh.js';
import { Navigator } from './navigator.js';
import { Fence, Pace, SLOW } from './pace.js';
import { Panel } from './panel.js';
import { Section } from './section.js';

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
	const raycaster = new Raycaster(), pace = new Pace(), fence = new Fence( renderer.getContext() );
	let dirty = true, measuring = false, measured = [], ready = false, frame = 0;
	const changed = () => dirty = true;

	const navigator = new Navigator( canvas, {
		pick: ( x, y ) => hit( x, y )?.point ?? null,
		bounds: () => ready ? mesh : { sphere: { center: new Vector3(), radius: 1 }, box: { min: new Vector3( - 1, - 1, - 1 ), max: new Vector3( 1, 1, 1 ) } },
		changed,
		clicked: ( x, y ) => click( x, y ),
	} );
	const mesh = new MeshView( renderer, navigator.camera, { changed, failed, opened } );
	mesh.tiles.group.matrixAutoUpdate = true;
	scene.add( mesh.tiles.group );

	// What can be done.

	const actions = {
		fit: () => navigator.fit(),
		view: name => navigator.view( name ),
		parallel() { navigator.go( { orthographic: ! navigator.orthographic } ); mesh.use( navigator.camera, renderer ); show(); },
		fly() { navigator.flying = ! navigator.flying; show(); },
		measure() { measuring = ! measuring; clear(); show(); },
		link() { remember(); panel.copy( location.href ); },
		theme() { theme( document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark' ); },
		color( mode ) { settings.color = mode; mesh.colorBy( mode ); panel.legend( mode, mesh ); show(); remember(); },
		range( low, high ) { mesh.setRange( settings.color, low, high ); panel.legend( settings.color, mesh ); },
		toggle( name, on ) { settings[ name ] = on; apply(); },
		detail( pixels ) { settings.detail = mesh.detail = pixels; changed(); },
		budget( mib ) { settings.budget = mesh.budget = mib; },
		section( axis ) {

			if ( axis && axis !== section.axis ) section.at = ( mesh.box.min[ axis ] + mesh.box.max[ axis ] ) / 2;
			section.axis = axis;
			show();
			changed();

		},
		sectionAt( part ) { const { min, max } = mesh.box, a = section.axis; section.at = min[ a ] + part * ( max[ a ] - min[ a ] ); show(); changed(); },
		sectionFlip() { section.side = - section.side; show(); changed(); },
	};
	const panel = new Panel( actions );
	const show = () => ready && panel.settings( { settings, navigator, section, mesh, measuring } );

	function apply() {

		shared.uFlat.value = Number( settings.flat );
		shared.uBacks.value = Number( settings.backs );
		mesh.showWires = settings.wire;
		mesh.showEdges = settings.boundary;
		show();
		changed();

	}

	function theme( name ) {

		document.documentElement.dataset.theme = name;
		renderer.setClearColor( GROUND[ name ], 1 );
		shared.uWire.value.set( 0x15181b );
		changed();

	}

	// The mesh comes.

	function opened( info ) {

		ready = true;
		const columns = info.columns.map( c => c.name ).filter( name => ! [ 'red', 'green', 'blue', 'nx', 'ny', 'nz' ].includes( name ) );
		const colored = info.columns.some( c => c.name === 'red' );
		const modes = [ [ 'plain', 'One colour' ], ...( colored ? [ [ 'color', 'Scan colour' ] ] : [] ), [ 'height', 'Height' ],
			...columns.map( name => [ `column:${ name }`, name[ 0 ].toUpperCase() + name.slice( 1 ).replaceAll( '_', ' ' ) ] ), [ 'tile', 'Tile' ], [ 'level', 'Level of detail' ] ];
		panel.opened( info, modes );
		actions.modes = modes.map( ( [ mode ] ) => mode );
		settings.color = colored ? 'color' : 'plain';
		if ( ! restore() ) navigator.view( 'oblique', false );
		apply();
		const first = () => {

			mesh.tiles.removeEventListener( 'load-model', first );
			actions.color( settings.color );
			panel.loaded();

		};
		mesh.tiles.addEventListener( 'load-model', first );

	}

	function failed( name, why ) {

		if ( ! name ) panel.failed( why );
		else {

			if ( mesh.missing.size && ! mesh.tiles.visibleTiles.size && mesh.missing.has( mesh.tiles.root ) ) panel.failed( `${ name } cannot be loaded; ${ why }.` );
			const more = mesh.missing.size > 1 ? ` (${ mesh.missing.size } tiles in all)` : '';
			panel.message( 'missing', `Tile ${ name } cannot be loaded${ more }; ${ why }.`, { action: { text: 'Try again', act: () => mesh.retry() } } );

		}

	}

	// Links.

	function restore() {

		const view = link.read( location.hash, mesh );
		if ( ! view ) return false;
		navigator.go( view.camera );
		mesh.use( navigator.camera, renderer );
		if ( view.section ) Object.assign( section, view.section );
		if ( actions.modes.includes( view.color ) ) settings.color = view.color;
		return true;

	}

	let written = '';
	function remember() {

		if ( ! ready ) return;
		written = link.write( { navigator, mesh, section, settings } );
		if ( written !== location.hash ) history.replaceState( null, '', written );

	}

	addEventListener( 'hashchange', () => ready && location.hash !== written && restore() && actions.color( settings.color ) );

	// Points.

	/** The nearest shown point of the mesh at a pixel. */
	function hit( x, y ) {

		if ( ! ready ) return null;
		navigator.apply();
		raycaster.setFromCamera( new Vector2( 2 * x / canvas.clientWidth - 1, 1 - 2 * y / canvas.clientHeight ), navigator.camera );
		if ( navigator.orthographic ) raycaster.ray.origin.addScaledVector( raycaster.ray.direction, - 4 * mesh.sphere.radius );
		return raycaster.intersectObject( mesh.tiles.group ).find( found => found.face && section.shows( found.point ) ) ?? null;

	}

	/** The corner of the triangle at a pixel that is nearest to it. */
	function vertexAt( x, y ) {

		const found = hit( x, y );
		if ( ! found ) return null;
		const { a, b, c } = found.face;
		const corners = [ a, b, c ].map( index => mesh.vertex( found.object, index ) );
		return corners.sort( ( p, q ) => p.local.distanceTo( found.point ) - q.local.distanceTo( found.point ) )[ 0 ];

	}

	function clear() {

		measured = [];
		marks.set( [] );
		panel.noResult();
		changed();

	}

	function click( x, y ) {

		const vertex = vertexAt( x, y );
		if ( measuring ) {

			if ( vertex ) measure( vertex );
			return;

		}

		if ( ! vertex ) return clear();
		marks.set( [ vertex.local ] );
		const note = mesh.info.exact === false ? 'Rounded: the mesh has finer coordinates than its levels of detail.' : vertex.level > 0 ? 'A vertex of the mesh; there may be nearer ones in finer levels.' : '';
		panel.result( 'Vertex', [ ...vertex.text.map( ( text, k ) => [ 'XYZ'[ k ], text ] ), ...vertex.values ], { text: vertex.text.join( ' ' ), note, close: clear } );
		changed();

	}

	/** Lengths between points: in space, on the ground, in height. */
	function lengths( points ) {

		const pairs = points.slice( 1 ).map( ( point, n ) => [ points[ n ], point ] );
		const sum = of => pairs.reduce( ( total, [ a, b ] ) => total + of( b.local.clone().sub( a.local ) ), 0 );
		return { each: pairs.map( ( [ a, b ] ) => a.local.distanceTo( b.local ) ), all: sum( d => d.length() ), flat: sum( d => Math.hypot( d.x, d.y ) ), rise: sum( d => d.z ) };

	}

	function measure( vertex ) {

		measured.push( vertex );
		const digits = Math.min( Math.max( mesh.decimals, 2 ), 6 ), { each, all, flat, rise } = lengths( measured );
		marks.set( measured.map( v => v.local ), each.map( x => x.toFixed( digits ) ) );
		const rows = [ [ 'Distance', all.toFixed( digits ) ], [ 'On the ground', flat.toFixed( digits ) ], [ 'Height', rise.toFixed( digits ) ] ];
		if ( measured.length > 2 ) rows.push( [ 'Parts', each.length ] );
		panel.result( 'Distance', measured.length > 1 ? rows : [ [ 'From', vertex.text.join( '  ' ) ] ], {
			text: measured.length > 1 ? all.toFixed( digits ) : null, note: measured.length > 1 ? 'Between vertices. Another click adds a part.' : 'Click the next point.', close: clear,
		} );
		changed();

	}

	// Keys.

	const KEYS = {
		f: actions.fit, 0: () => actions.view( 'oblique' ), 1: () => actions.view( 'top' ), 2: () => actions.view( 'front' ), 3: () => actions.view( 'right' ),
		4: () => actions.view( 'left' ), 5: () => actions.view( 'back' ), 6: () => actions.view( 'bottom' ),
		o: actions.parallel, g: actions.fly, m: actions.measure, l: actions.link, n: actions.theme, '?': () => panel.help(), h: () => panel.help(),
		c: () => actions.color( actions.modes[ ( actions.modes.indexOf( settings.color ) + 1 ) % actions.modes.length ] ),
		...Object.fromEntries( [ [ 'e', 'edl' ], [ 't', 'flat' ], [ 'k', 'backs' ], [ 'x', 'wire' ], [ 'b', 'boundary' ] ].map( ( [ key, name ] ) => [ key, () => actions.toggle( name, ! settings[ name ] ) ] ) ),
		escape() { if ( measuring && measured.length === 0 ) measuring = false; if ( navigator.flying ) navigator.flying = false; clear(); show(); },
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
		mesh.update( navigator.camera, renderer, pace.coarser( now ) );

	}

	function draw( now ) {

		const ratio = sharp * pace.pixels( now );
		if ( renderer.getPixelRatio() !== ratio ) renderer.setPixelRatio( ratio );
		section.apply( navigator.camera );
		if ( settings.edl ) dome.draw( scene, navigator.camera, navigator.viewHeight() );
		else renderer.render( scene, navigator.camera );
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
		const loading = ! ready || mesh.tiles.isLoading;
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
		const stats = mesh.stats(), moves = pace.moves( performance.now() );
		panel.stats( { ...stats, coarser: Math.max( stats.coarser, pace.coarser( performance.now() ) ) }, mesh.info, milliseconds );
		// While the view moves, the pace decides. One change for each picture, which shows what it did.
		if ( ! moves && frame !== limited ) mesh.limit( stats.triangles );
		limited = frame;
		if ( ! navigator.moving && ! navigator.pointers.size ) remember();

	}, 250 );
	setInterval( () => {

		if ( ! pointer || ! ready || performance.now() - pointer.at < 60 || pointer.told ) return;
		pointer.told = true;
		const found = hit( pointer.x, pointer.y );
		panel.cursor( found ? mesh.toScan( found.point ).map( ( x, k ) => `${ 'XYZ'[ k ] } ${ x.toFixed( Math.min( mesh.decimals, 3 ) ) }` ).join( '   ' ) : '' );

	}, 60 );

	theme( matchMedia( '(prefers-color-scheme: dark)' ).matches ? 'dark' : 'light' );
	canvas.addEventListener( 'webglcontextlost', event => { event.preventDefault(); panel.message( 'lost', 'The graphics were reset. Reload the page to go on.' ); } );
	requestAnimationFrame( loop );

	// For tests and for those who drive the page by a program.
	window.outcropViewer = {
		mesh, navigator, actions, settings, section, pace,
		get ready() { return ready; },
		get frame() { return frame; },
		/** Time that the page itself takes for a picture, without that of the graphics, in ms. */
		get milliseconds() { return milliseconds; },
		/** True if nothing is loading and the last change is drawn. */
		get settled() { return ready && ! dirty && ! stale && busy <= 0 && ! navigator.moving && ! paced && ! mesh.tiles.isLoading && mesh.stats().loading === 0; },
		/** What is drawn, as a PNG in a URL. */
		picture() { const now = performance.now(); update( now ); draw( now ); return canvas.toDataURL(); },
		stats: () => mesh.stats(), vertexAt, hit, click, redraw: changed, use: () => mesh.use( navigator.camera, renderer ),
		get measured() { return lengths( measured ); },
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
