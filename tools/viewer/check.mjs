// Looks at a mesh in a real browser: called by scripts/check-view with the program, the renderer, the browser, and
// a folder that has mesh.ply. Numbers and pictures are compared with the mesh file and with tools/render.

import { execFileSync } from 'node:child_process';
import { cpSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { first, two } from './check-two.mjs';
import { begin, check, end, open, passed, serve, SIZE, vertices } from './look.mjs';
import { Pace } from './src/pace.js';

const [ outcrop, render, chromium, modules, folder ] = process.argv.slice( 2 );
const HALF = Math.tan( 45 / 2 * Math.PI / 180 );

await begin( outcrop, chromium, modules );
/** The pace by itself: pictures that take long make it coarser, short ones finer, and a view at rest has all detail. */
function paces() {

	const pace = new Pace();
	let now = 0;
	const move = ( pictures, time ) => {

		for ( let n = 0; n < pictures; n ++ ) {

			pace.moved( now );
			const took = time( pace.factor );
			pace.took( now, took, true );
			now += took;

		}

		pace.moved( now );
		return pace.coarser( now );

	};
	const fine = move( 30, () => 16 );
	// As on a processor: what is fixed, and the triangles.
	const time = factor => 20 + 3000 / factor ** 2;
	const coarse = move( 60, time );
	check( 'the pace follows a slow machine', fine === 1 && time( coarse ) < 70 && coarse < 16 && pace.pixels( now ) === 0.5, { fine, coarse } );
	now += 1000;
	check( 'a view at rest has all detail', pace.coarser( now ) === 1 && pace.pixels( now ) === 1 );
	pace.took( now, 5000, false );
	now += 5000;
	check( 'and is not drawn all the time while tiles load', pace.due( now, false ) && ! pace.due( now, true ) && pace.due( now + 10000, true ) );
	check( 'the pace is kept for the next move', move( 0, time ) === coarse );
	check( 'and finer again on a fast machine', move( 200, () => 16 ) === 1 );

}

/** The camera of tools/render, without its cropping. */
function cameraOf( points, azimuth, elevation ) {

	const [ a, e ] = [ azimuth, elevation ].map( x => x * Math.PI / 180 );
	const towards = [ Math.cos( a ) * Math.cos( e ), Math.sin( a ) * Math.cos( e ), Math.sin( e ) ];
	const right = [ - Math.sin( a ), Math.cos( a ), 0 ];
	const up = [ 0, 1, 2 ].map( k => towards[ ( k + 1 ) % 3 ] * right[ ( k + 2 ) % 3 ] - towards[ ( k + 2 ) % 3 ] * right[ ( k + 1 ) % 3 ] );
	const spans = [ right, up, towards ].map( axis => {

		let [ low, high ] = [ Infinity, - Infinity ];
		for ( const { at } of points ) {

			const x = at[ 0 ] * axis[ 0 ] + at[ 1 ] * axis[ 1 ] + at[ 2 ] * axis[ 2 ];
			[ low, high ] = [ Math.min( low, x ), Math.max( high, x ) ];

		}

		return [ low, high ];

	} );
	const middle = spans.map( ( [ low, high ] ) => ( low + high ) / 2 );
	const scale = Math.min( 0.9 * SIZE.width / ( spans[ 0 ][ 1 ] - spans[ 0 ][ 0 ] ), 0.9 * SIZE.height / ( spans[ 1 ][ 1 ] - spans[ 1 ][ 0 ] ) );
	return { center: [ 0, 1, 2 ].map( k => right[ k ] * middle[ 0 ] + up[ k ] * middle[ 1 ] + towards[ k ] * middle[ 2 ] ), yaw: a + Math.PI, pitch: - e, distance: SIZE.height / scale / 2 / HALF };

}

/** Looks as tools/render does, and compares where the mesh is: shared pixels of all that either has. */
async function overlap( { page, settled }, camera, reference ) {

	await page.evaluate( ( { center, yaw, pitch, distance } ) => {

		const v = window.outcropViewer;
		v.navigator.go( { focus: v.mesh.toLocal( center ), yaw, pitch, distance, orthographic: true } );
		v.use();

	}, camera );
	await settled();
	return page.evaluate( async reference => {

		const masks = [];
		for ( const url of [ window.outcropViewer.picture(), reference ] ) {

			const image = new Image();
			image.src = url;
			await image.decode();
			const canvas = new OffscreenCanvas( image.width, image.height ), context = canvas.getContext( '2d' );
			context.drawImage( image, 0, 0 );
			const { data } = context.getImageData( 0, 0, image.width, image.height );
			masks.push( { size: [ image.width, image.height ].join(), mask: Array.from( { length: data.length / 4 }, ( _, n ) => [ 0, 1, 2 ].some( k => Math.abs( data[ 4 * n + k ] - data[ k ] ) > 8 ) ) } );

		}

		const [ a, b ] = masks;
		if ( a.size !== b.size ) return { size: [ a.size, b.size ] };
		let [ both, either ] = [ 0, 0 ];
		for ( let n = 0; n < a.mask.length; n ++ ) {

			both += a.mask[ n ] && b.mask[ n ];
			either += a.mask[ n ] || b.mask[ n ];

		}

		return { both, part: both / either };

	}, reference );

}

async function main() {

	const mesh = join( folder, 'mesh.ply' ), tiles = join( folder, 'kept' );
	const points = vertices( mesh );
	const known = new Map( points.map( point => [ point.at.map( x => x.toFixed( 3 ) ).join( ' ' ), point ] ) );
	// Half a unit of the last decimal that the mesh file has would be another point.
	const find = ( { X, Y, Z } ) => {

		const point = known.get( [ X, Y, Z ].map( x => Number( x ).toFixed( 3 ) ).join( ' ' ) );
		return point && [ X, Y, Z ].every( ( x, k ) => Math.abs( x - point.at[ k ] ) < 1e-6 ) ? point : undefined;

	};
	const camera = cameraOf( points, - 50, 32 );
	execFileSync( render, [ mesh, '-o', join( folder, 'render.png' ), '--width', SIZE.width, '--height', SIZE.height, '--view', 'iso', '--supersample', '1', '--crop-percentile', '0' ] );
	const reference = 'data:image/png;base64,' + readFileSync( join( folder, 'render.png' ) ).toString( 'base64' );

	paces();
	const server = await serve( mesh, `--keep=${ tiles }` );
	const shown = await open( server.url ), { page, asked, errors, settled } = shown;
	const first = await page.evaluate( () => window.outcropViewer.stats() );
	check( 'it loads', first.triangles > 1000 && first.tiles > 0 && first.missing === 0, first );
	check( 'the title', await page.title() === 'mesh.ply – outcrop' );
	const seen = await overlap( shown, camera, reference );
	check( 'the picture shows the mesh where tools/render does', seen.part > 0.98 && seen.both > 50000, seen );

	// Zoom to the middle with the wheel.
	await page.mouse.move( SIZE.width / 2, SIZE.height / 2 );
	const levels = () => page.evaluate( () => [ ...window.outcropViewer.mesh.tiles.visibleTiles ].map( tile => tile.extras.outcrop.level ) );
	const before = await levels();
	for ( let n = 0; n < 14; n ++ ) await page.mouse.wheel( 0, - 240 );
	await settled();
	const after = await levels();
	check( 'it refines when zooming', Math.max( ...before ) > 0 && Math.min( ...after ) === 0 && Math.max( ...after ) < Math.max( ...before ), { before, after } );

	// On a slow machine a moving view is coarser, and as it was when it rests.
	const slow = await page.evaluate( () => new Promise( resolve => {

		const v = window.outcropViewer, { yaw } = v.navigator, rest = v.stats().triangles;
		v.pace.factor = 64;
		v.pace.took = () => {};
		let frame = 0, least = rest, pixels = 1;
		const step = () => {

			least = Math.min( least, v.stats().triangles );
			pixels = Math.min( pixels, v.pace.pixels( performance.now() ) );
			v.navigator.yaw = ++ frame < 20 ? yaw + 0.01 * frame : yaw;
			v.redraw();
			if ( frame < 20 ) requestAnimationFrame( step );
			else resolve( { rest, least, pixels } );

		};
		step();

	} ) );
	await settled();
	const again = await page.evaluate( () => {

		const v = window.outcropViewer;
		v.pace.factor = 1;
		delete v.pace.took;
		return v.stats().triangles;

	} );
	check( 'a moving view is coarser on a slow machine, not at rest', slow.least < 0.5 * slow.rest && slow.pixels === 0.5 && again === slow.rest, { ...slow, again } );

	// A vertex, by a click.
	const result = () => page.evaluate( () => Object.fromEntries( [ ...document.querySelectorAll( '#result dt' ) ].map( dt => [ dt.textContent, dt.nextSibling.textContent ] ) ) );
	const click = async ( x, y ) => { await page.mouse.click( x, y ); await settled(); };
	await click( SIZE.width / 2, SIZE.height / 2 );
	const vertex = await result();
	const point = find( vertex );
	check( 'a picked vertex has the coordinates in the mesh', Boolean( point ), vertex );
	check( 'and its values', vertex.color === point.color.join( ' ' ), vertex.color );

	// A distance.
	const places = [ [ 330, 300 ], [ 520, 420 ] ];
	const ends = [];
	for ( const place of places ) {

		await click( ...place );
		const { X, Y, Z } = await result();
		ends.push( find( { X, Y, Z } ).at );

	}

	await page.keyboard.press( 'm' );
	for ( const place of places ) await click( ...place );
	const distance = await result(), truth = Math.hypot( ...[ 0, 1, 2 ].map( k => ends[ 1 ][ k ] - ends[ 0 ][ k ] ) );
	check( 'it measures', truth > 0.01 && Math.abs( Number( distance.Distance ) - truth ) < 1e-6, { distance, truth } );
	check( 'the label has it, too', await page.textContent( '.label' ) === distance.Distance );
	await page.keyboard.press( 'Escape' );
	await page.keyboard.press( 'Escape' );

	// Every way to look, by keys.
	const colors = () => page.evaluate( async () => {

		const image = new Image();
		image.src = window.outcropViewer.picture();
		await image.decode();
		const canvas = new OffscreenCanvas( image.width, image.height ), context = canvas.getContext( '2d' );
		context.drawImage( image, 0, 0 );
		const { data } = context.getImageData( 0, 0, image.width, image.height );
		let [ red, all ] = [ 0, 0 ];
		for ( let n = 0; n < data.length; n += 4 ) red += data[ n ] > 150 && data[ n + 1 ] < 90 && data[ n + 2 ] < 90;
		for ( let n = 0; n < data.length; n += 4 ) all += [ 0, 1, 2 ].some( k => Math.abs( data[ n + k ] - data[ k ] ) > 8 );
		return { red, all };

	} );
	await overlap( shown, camera, reference );
	await page.selectOption( '#color', 'plain' );
	await page.locator( '#color' ).blur();
	await settled();
	const calm = await colors();
	for ( const key of [ 'e', 't', 'k', 'x', 'b' ] ) { await page.keyboard.press( key ); await settled(); }
	const busy = await colors();
	check( 'boundary edges are drawn', busy.red > calm.red + 200, { calm, busy } );
	for ( const key of [ 'e', 't', 'k', 'x', 'b' ] ) await page.keyboard.press( key );
	for ( let n = 0; n < 6; n ++ ) { await page.keyboard.press( 'c' ); await settled(); }
	await page.click( '#section-axis [data-axis=x]' );
	await settled();
	const cut = await colors();
	check( 'a section hides a part', cut.all > 0.2 * calm.all && cut.all < 0.8 * calm.all, { cut, calm } );
	await page.click( '#section-axis [data-axis=""]' );

	// A link.
	await page.evaluate( () => window.outcropViewer.actions.view( 'front' ) );
	await settled();
	await page.waitForTimeout( 600 );
	const state = () => page.evaluate( () => { const { focus, ...s } = window.outcropViewer.navigator.state(); return { ...s, at: window.outcropViewer.mesh.toScan( focus ) }; } );
	const left = await state();
	await page.reload();
	await settled();
	const back = await state();
	const near = ( a, b ) => Math.abs( a - b ) < 1e-3;
	check( 'a link leads to the same view', near( left.yaw, back.yaw ) && near( left.pitch, back.pitch ) && near( left.distance, back.distance ) && left.at.every( ( x, k ) => near( x, back.at[ k ] ) ), back );

	// Flying by keys.
	const camera1 = () => page.evaluate( () => window.outcropViewer.navigator.camera.position.toArray() );
	const moved = ( a, b ) => Math.hypot( ...a.map( ( x, k ) => x - b[ k ] ) );
	await page.keyboard.press( 'g' );
	const flights = {};
	for ( const key of [ 'w', 's', 'a', 'd', 'q', 'e' ] ) {

		const from = await camera1();
		await page.keyboard.down( key );
		await page.waitForTimeout( 400 );
		await page.keyboard.up( key );
		await page.waitForTimeout( 100 );
		flights[ key ] = ( await camera1() ).map( ( x, k ) => x - from[ k ] );

	}

	const against = ( a, b ) => a.reduce( ( sum, x, k ) => sum + x * b[ k ], 0 ) < 0;
	check( 'keys fly to all sides', Object.values( flights ).every( way => Math.hypot( ...way ) > 0 ) && against( flights.w, flights.s ) && against( flights.a, flights.d ) && flights.q[ 2 ] < 0 && flights.e[ 2 ] > 0,
		Object.fromEntries( Object.entries( flights ).map( ( [ key, way ] ) => [ key, way.map( x => Number( x.toFixed( 2 ) ) ).join( ' ' ) ] ) ) );
	await page.keyboard.press( 'Escape' );

	// Fingers.
	await page.keyboard.press( 'f' );
	await settled();
	const devtools = await page.context().newCDPSession( page );
	const fingers = async ( ...path ) => {

		for ( const [ n, points ] of path.entries() ) await devtools.send( 'Input.dispatchTouchEvent', { type: n ? 'touchMove' : 'touchStart', touchPoints: points.map( ( [ x, y ], id ) => ( { x, y, id } ) ) } );
		await devtools.send( 'Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] } );
		await settled();

	};
	const look = () => page.evaluate( () => { const { yaw, pitch, distance, focus } = window.outcropViewer.navigator; return { yaw, pitch, distance, focus: focus.toArray() }; } );
	const still = await look();
	await fingers( [ [ 400, 300 ] ], [ [ 430, 310 ] ], [ [ 500, 330 ] ] );
	const turned = await look();
	check( 'a finger turns', Math.abs( turned.yaw - still.yaw ) > 0.05, turned.yaw - still.yaw );
	await fingers( [ [ 400, 350 ], [ 500, 350 ] ], [ [ 350, 350 ], [ 550, 350 ] ], [ [ 300, 350 ], [ 600, 350 ] ] );
	const pinched = await look();
	check( 'two fingers zoom', pinched.distance < 0.7 * turned.distance, pinched.distance / turned.distance );
	await fingers( [ [ 400, 350 ], [ 500, 350 ] ], [ [ 400, 300 ], [ 500, 300 ] ], [ [ 400, 250 ], [ 500, 250 ] ] );
	const shifted = await look();
	check( 'and shift', moved( shifted.focus, pinched.focus ) > 0.01 && Math.abs( shifted.distance / pinched.distance - 1 ) < 0.2, moved( shifted.focus, pinched.focus ) );

	// Little memory.
	await page.evaluate( () => window.outcropViewer.actions.budget( 8 ) );
	await page.keyboard.press( 'Escape' );
	await page.evaluate( () => { window.outcropViewer.actions.detail( 1e-9 ); window.outcropViewer.actions.view( 'oblique' ); } );
	await page.waitForTimeout( 4000 );
	const little = await page.evaluate( () => window.outcropViewer.stats() );
	check( 'the memory is bounded', little.full && little.bytes < 12 * 2 ** 20 && little.triangles > 0, little );

	check( 'no console errors', errors.length === 0, errors.join( '; ' ) );
	const origin = new URL( server.url ).origin;
	check( 'no request to anywhere else', asked.length > 5 && asked.every( url => url.startsWith( server.url ) || url.startsWith( 'data:' ) || url.startsWith( `blob:${ origin }` ) ), `${ asked.length } requests` );
	await page.close();
	check( 'Ctrl-C ends it', await server.stop( 'SIGINT' ) === 0 );

	// Without a tile.
	const holed = join( folder, 'holed' );
	cpSync( tiles, holed, { recursive: true } );
	const leaf = tile => tile.children?.length ? leaf( tile.children[ 0 ] ) : tile.content.uri;
	const lost = leaf( JSON.parse( readFileSync( join( holed, 'tileset.json' ) ) ).root );
	rmSync( join( holed, lost ) );
	const second = await serve( holed );
	const damaged = await open( second.url );
	await damaged.page.evaluate( () => window.outcropViewer.actions.detail( 1e-9 ) );
	await damaged.settled();
	const hole = await overlap( damaged, camera, reference );
	check( 'a missing tile leaves no hole', hole.part > 0.98, hole );
	const text = await damaged.page.textContent( '#messages' );
	check( 'and is told', text.includes( lost ), text );
	check( 'without other errors', damaged.errors.every( error => /404|Failed to load tile/.test( error ) ), damaged.errors.join( '; ' ) );
	await damaged.page.close();
	check( 'SIGTERM ends it, too', await second.stop( 'SIGTERM' ) === 0 );

	// On the globe.
	writeFileSync( join( folder, 'mesh.prj' ), 'PROJCS["UTM zone 33N",GEOGCS["WGS 84"],AUTHORITY["EPSG","32633"]]\n' );
	const globe = join( folder, 'globe' );
	execFileSync( outcrop, [ 'tiles', mesh, '-o', globe, '--geo', '--quiet' ] );
	rmSync( join( folder, 'mesh.prj' ) );
	check( 'a tileset has a place on the globe', Math.hypot( ...JSON.parse( readFileSync( join( globe, 'tileset.json' ) ) ).root.transform.slice( 12, 15 ) ) > 6.3e6 );
	const fourth = await serve( globe );
	const placed = await open( fourth.url );
	const there = await overlap( placed, camera, reference );
	check( 'which is shown as the others', there.part > 0.98, there );
	await placed.page.mouse.click( SIZE.width / 2, SIZE.height / 2 );
	await placed.settled();
	const onGlobe = await placed.page.evaluate( () => Object.fromEntries( [ ...document.querySelectorAll( '#result dt' ) ].map( dt => [ dt.textContent, dt.nextSibling.textContent ] ) ) );
	check( 'and has the coordinates of the scan', Boolean( find( onGlobe ) ), onGlobe );
	check( 'without errors there', placed.errors.length === 0, placed.errors.join( '; ' ) );
	await placed.page.close();
	await fourth.stop( 'SIGINT' );

	// One file.
	const page1 = join( folder, 'mesh.html' );
	execFileSync( outcrop, [ 'view', tiles, '--html', page1, '--html-limit', '3MB', '--quiet' ] );
	check( 'the page is as small as asked for', readFileSync( page1 ).length <= 3e6, `${ readFileSync( page1 ).length } bytes` );
	const single = await open( `file://${ page1 }` );
	const alone = await overlap( single, camera, reference );
	check( 'it shows the mesh from a file', alone.part > 0.97, alone );
	check( 'which asks for nothing', single.asked.every( url => url.startsWith( `file://${ page1 }` ) || /^(data|blob):/.test( url ) ), single.asked.filter( url => ! url.startsWith( 'data:' ) ).join( ' ' ) );
	check( 'without errors', single.errors.length === 0, single.errors.join( '; ' ) );
	await single.page.close();

	// Levels of detail that are not kept.
	const third = await serve( mesh );
	const made = () => readdirSync( folder ).filter( name => name.startsWith( 'outcrop-view-' ) );
	check( 'levels of detail are made for the time of looking', made().length === 1, made() );
	await third.stop( 'SIGINT' );
	check( 'and deleted after it', made().length === 0, made() );

}

async function all() {

	await main();
	await first( folder );
	await two( folder );

}

all().then( () => console.log( `check-view: ${ passed() } checks` ), error => { console.error( `check-view: ${ error.message }` ); process.exitCode = 1; } ).finally( end );
