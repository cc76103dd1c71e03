// Looks at two meshes in one place, at points beside them, and at the page while something is still on its way.

import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { check, open, picture, serve, SIZE, vertices } from './look.mjs';

/** Pixels of a picture that are not as its first one, and those near a colour. */
function counts( { data }, color ) {

	let [ other, near ] = [ 0, 0 ];
	for ( let n = 0; n < data.length; n += 4 ) {

		other += [ 0, 1, 2 ].some( k => Math.abs( data[ n + k ] - data[ k ] ) > 8 );
		near += [ 0, 1, 2 ].every( k => Math.abs( data[ n + k ] - color?.[ k ] ) < 12 );

	}

	return { other, near };

}

/** The part of the pixels between two columns that are the same in two pictures. */
function same( a, b, from, to ) {

	let equal = 0;
	for ( let y = 0; y < a.height; y ++ ) for ( let x = from; x < to; x ++ ) equal += [ 0, 1, 2 ].every( k => Math.abs( a.data[ 4 * ( y * a.width + x ) + k ] - b.data[ 4 * ( y * a.width + x ) + k ] ) <= 2 );
	return equal / a.height / ( to - from );

}

/** The first picture is there before all tiles are, and the page before there are any. */
export async function first( folder ) {

	const tiles = join( folder, 'kept' ), coarsest = JSON.parse( readFileSync( join( tiles, 'tileset.json' ) ) ).root.content.uri;
	const server = await serve( tiles );
	let release;
	const held = new Promise( resolve => release = resolve );
	const { page, settled } = await open( server.url, { wait: false, prepare: page => page.route( '**/mesh/tiles/*', async route => {

		if ( ! route.request().url().endsWith( coarsest ) ) await held;
		await route.continue().catch( () => {} );

	} ) } );
	await page.waitForFunction( () => window.outcropViewer?.ready && window.outcropViewer.stats().triangles > 0 );
	await page.evaluate( () => window.outcropViewer.actions.detail( 0.2 ) );
	await page.waitForSelector( '#progress div' );
	const early = counts( await picture( page ) ).other, told = await page.textContent( '#progress' );
	check( 'the coarsest tile is shown before the others come', early > 50000 && await page.evaluate( () => document.getElementById( 'loading' ).classList.contains( 'done' ) ), early );
	check( 'and what is loading is told', /Loading \d+ tile/.test( told ), told );
	release();
	await settled();
	await page.waitForTimeout( 400 );
	check( 'until all is there', await page.isHidden( '#progress' ) );
	await page.close();
	await server.stop( 'SIGINT' );

	const since = performance.now(), slow = await serve( join( folder, 'mesh.ply' ), '--threads', '1' ), opened = performance.now() - since;
	const making = await open( slow.url, { prepare: page => page.addInitScript( () => addEventListener( 'DOMContentLoaded', () => {

		const text = document.querySelector( '#loading p' );
		window.told = [];
		new MutationObserver( () => window.told.push( text.textContent ) ).observe( text, { childList: true } );

	} ) ) } );
	const texts = await making.page.evaluate( () => window.told ), ready = performance.now() - since;
	check( 'a mesh without levels of detail has its page at once', texts.some( text => text.startsWith( 'Making levels of detail of mesh.ply' ) ), `after ${ opened.toFixed( 0 ) } ms, the mesh after ${ ready.toFixed( 0 ) }; ${ texts.at( - 2 ) ?? '' }` );
	check( 'and nothing goes wrong', making.errors.length === 0, making.errors.join( '; ' ) );
	await making.page.close();
	await slow.stop( 'SIGINT' );

}

/** Two meshes, the line between them, and points. */
export async function two( folder ) {

	const cloud = join( folder, 'cloud.ply' ), after = join( folder, 'after.ply' );
	const server = await serve( join( folder, 'kept' ), after, '--points', cloud, '--points-limit', '20000' );
	const { page, errors, settled, asked } = await open( server.url );
	const act = async code => { await page.evaluate( code ); await settled(); };
	const names = await page.evaluate( () => [ 'name-a', 'name-b', 'name' ].map( id => document.getElementById( id ).textContent ) );
	check( 'two meshes have their names', names.join( '; ' ) === 'kept; after.ply; kept, after.ply', names.join( '; ' ) );
	await lines( page, act );
	await places( page, act, vertices( join( folder, 'later.ply' ) ) );
	await points( page, act, settled, vertices( cloud ) );
	check( 'two meshes and points give no errors', errors.length === 0, errors.join( '; ' ) );
	check( 'and ask nobody else', asked.every( url => url.startsWith( server.url ) || /^(data|blob):/.test( url ) ) );
	await page.close();
	await server.stop( 'SIGINT' );

}

/** Each side of the line shows its mesh; the line moves. */
async function lines( page, act ) {

	await act( () => { const v = window.outcropViewer; v.world.cloud.set( { on: false } ); v.navigator.go( { orthographic: true } ); v.use(); v.navigator.view( 'top', false ); } );
	await act( () => window.outcropViewer.split.set( 'a' ) );
	const a = await picture( page );
	await act( () => window.outcropViewer.split.set( 'b' ) );
	const b = await picture( page );
	await act( () => window.outcropViewer.split.set( 'split' ) );
	const border = at => {

		const x = Math.round( at * SIZE.width );
		return shown => ( { left: same( shown, a, 0, x - 4 ), right: same( shown, b, x + 4, SIZE.width ), other: same( a, b, 0, x - 4 ), another: same( a, b, x + 4, SIZE.width ) } );

	};
	const fine = ( { left, right, other, another } ) => left > 0.995 && right > 0.995 && other < 0.98 && another < 0.98;
	const half = border( 0.5 )( await picture( page ) );
	check( 'A is on the left of the line, B on the right', fine( half ), half );
	await page.mouse.move( SIZE.width / 2, 300 );
	await page.mouse.down();
	await page.mouse.move( SIZE.width * 0.4, 320 );
	await page.mouse.move( SIZE.width * 0.35, 320 );
	await page.mouse.up();
	const at = await page.evaluate( () => window.outcropViewer.split.at ), moved = border( at )( await picture( page ) );
	check( 'a drag moves the line', Math.abs( at - 0.35 ) < 0.01 && fine( moved ), { at, ...moved } );
	await page.keyboard.press( ']' );
	check( 'a key, too', Math.abs( await page.evaluate( () => window.outcropViewer.split.at ) - at - 0.02 ) < 1e-9 );
	const modes = [];
	for ( let n = 0; n < 4; n ++ ) {

		await page.keyboard.press( 'v' );
		modes.push( await page.getAttribute( '#compare [aria-checked=true]', 'data-show' ) );

	}

	check( 'V shows one after the other', modes.join() === 'a,b,both,split', modes.join() );
	await page.click( '#compare [data-show=both]' );
	const together = await picture( page );
	check( 'both together are neither of them', same( together, a, 0, SIZE.width ) < 0.99 && same( together, b, 0, SIZE.width ) < 0.99 );

}

/** The meshes are where their coordinates put them. */
async function places( page, act, truth ) {

	const known = new Set( truth.map( ( { at } ) => at.map( x => x.toFixed( 3 ) ).join( ' ' ) ) );
	const vertex = async mode => {

		await act( `window.outcropViewer.split.set( '${ mode }' )` );
		return page.evaluate( () => { const { text, local, scan } = window.outcropViewer.vertexAt( 600, 180 ); return { text, scan, local: local.toArray() }; } );

	};
	const [ a, b ] = [ await vertex( 'a' ), await vertex( 'b' ) ];
	check( 'a vertex of B has its coordinates', known.has( b.text.map( x => Number( x ).toFixed( 3 ) ).join( ' ' ) ), b.text.join( ' ' ) );
	const apart = [ 0, 1, 2 ].map( k => b.scan[ k ] - a.scan[ k ] ), shown = [ 0, 1, 2 ].map( k => b.local[ k ] - a.local[ k ] );
	check( 'at the place of A where both are the same', Math.hypot( ...apart ) < 2 && Math.hypot( ...apart.map( ( x, k ) => x - shown[ k ] ) ) < 1e-6, { apart, shown } );

}

/** An even part of the points, where they were measured; the link tells all of it. */
async function points( page, act, settled, truth ) {

	const known = new Set( truth.map( ( { at } ) => at.map( x => x.toFixed( 3 ) ).join( ' ' ) ) );
	const found = await page.evaluate( () => {

		const { cloud, first } = window.outcropViewer.world, { position } = cloud.object.geometry.attributes;
		const at = first.box.min.clone(), all = [];
		for ( let n = 0; n < position.count; n += 7 ) all.push( first.toScan( at.fromBufferAttribute( position, n ).applyMatrix4( cloud.object.matrixWorld ) ) );
		return { ...cloud.info, all, note: document.getElementById( 'points-note' ).textContent };

	} );
	check( 'an even part of the points is there', found.points <= 20000 && found.points > 10000 && found.of_points === truth.length, found.note );
	check( 'where they were measured', found.all.every( scan => known.has( scan.map( x => x.toFixed( 3 ) ).join( ' ' ) ) ), `${ found.all.length } looked at` );
	await page.keyboard.press( 'e' );
	await act( () => { const v = window.outcropViewer; v.split.set( 'split' ); v.split.move( 0.3 ); v.actions.points( { on: true, size: 4, color: 'plain' } ); } );
	const blue = [ 26, 107, 179 ], on = counts( await picture( page ), blue ).near;
	await page.keyboard.press( 'p' );
	await settled();
	const off = counts( await picture( page ), blue ).near;
	check( 'points are drawn, or not', on > 20000 && off < 100, { on, off } );
	await page.keyboard.press( 'p' );
	await settled();
	await page.waitForTimeout( 600 );
	await page.reload();
	await settled();
	const back = await page.evaluate( () => { const { split, world: { cloud } } = window.outcropViewer; return [ split.mode, split.at, cloud.on, cloud.size, cloud.color ].join(); } );
	check( 'a link has the line and the points', back === 'split,0.3,true,4,plain', back );

}
