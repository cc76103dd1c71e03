// Measures how fast tilesets are drawn while the camera goes round: called by scripts/view-rate with the program, the
// browser, its modules, and folders with tilesets.

import { spawn } from 'node:child_process';
import { createRequire } from 'node:module';
import { join } from 'node:path';

const [ outcrop, chromium, modules, ...folders ] = process.argv.slice( 2 );
const { chromium: driver } = createRequire( join( modules, 'x.js' ) )( 'playwright-core' );
const SIZE = { width: 1280, height: 800 };
const PATIENCE = 1200000;
const SECONDS = 20;

/** Goes round twice: at first the page finds its pace, then pictures are counted. */
const round = seconds => new Promise( resolve => {

	const v = window.outcropViewer, yaw = v.navigator.yaw, began = performance.now();
	const rest = v.stats().triangles;
	let bytes = 0, first = null, since = 0, shown = [], longest = 0, last = began;
	const step = () => {

		const now = performance.now(), part = ( now - began ) / 1000 / seconds, stats = v.stats();
		bytes = Math.max( bytes, stats.bytes );
		if ( part >= 1 && first === null ) [ first, since ] = [ v.frame, now ];
		if ( first !== null ) {

			shown.push( stats.triangles );
			longest = Math.max( longest, now - last );

		}

		last = now;
		if ( part >= 2 ) {

			shown.sort( ( a, b ) => a - b );
			return resolve( { rest, bytes, longest, own: v.milliseconds, shown: shown[ shown.length >> 1 ], frames: 1000 * ( v.frame - first ) / ( now - since ) } );

		}

		v.navigator.yaw = yaw + 2 * Math.PI * part;
		v.redraw();
		requestAnimationFrame( step );

	};
	step();

} );

async function measure( browser, folder ) {

	const child = spawn( outcrop, [ 'view', '--no-browser', '--quiet', folder ], { stdio: [ 'ignore', 'pipe', 'inherit' ] } );
	const url = await new Promise( ( resolve, reject ) => {

		child.stdout.once( 'data', text => resolve( String( text ).trim() ) );
		child.on( 'exit', code => reject( new Error( `outcrop view ended with ${ code }` ) ) );

	} );
	const page = await browser.newPage( { viewport: SIZE } );
	const devtools = await page.context().newCDPSession( page );
	await devtools.send( 'Performance.enable' );
	await page.goto( url );
	const settled = () => page.waitForFunction( () => window.outcropViewer?.settled, null, { timeout: PATIENCE } );
	await settled();
	const all = await page.evaluate( () => window.outcropViewer.mesh.info.triangles );
	for ( const [ view, zoom ] of [ [ 'oblique', 1 ], [ 'closer', 6 ], [ 'near', 36 ] ] ) {

		await page.evaluate( zoom => { const v = window.outcropViewer; v.actions.view( 'oblique' ); return zoom; }, zoom );
		await page.waitForTimeout( 1500 );
		await page.evaluate( zoom => { const v = window.outcropViewer; v.navigator.distance /= zoom; v.redraw(); }, zoom );
		await settled();
		await page.waitForTimeout( 500 );
		await settled();
		const found = await page.evaluate( round, SECONDS );
		const { metrics } = await devtools.send( 'Performance.getMetrics' );
		const heap = metrics.find( metric => metric.name === 'JSHeapUsedSize' ).value;
		console.log( `${ folder }: ${ all } triangles, ${ view }: ${ found.frames.toFixed( 1 ) } pictures a second while it turns, the longest in ${ found.longest.toFixed( 0 ) } ms (${ found.own.toFixed( 1 ) } ms without the graphics), of ${ found.shown } triangles (${ found.rest } at rest), ${ ( found.bytes / 2 ** 20 ).toFixed( 0 ) } MiB of tiles, ${ ( heap / 2 ** 20 ).toFixed( 0 ) } MiB of heap` );

	}

	await page.close();
	child.removeAllListeners( 'exit' );
	child.kill( 'SIGINT' );

}

const browser = await driver.launch( { executablePath: chromium, args: [ '--headless', '--no-sandbox', '--enable-unsafe-swiftshader', '--use-angle=swiftshader' ] } );
try {

	for ( const folder of folders ) await measure( browser, folder );

} finally {

	await browser.close();

}
