// What the checks of the page share: the program, the browser, and what is seen in it.

import { spawn } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';

export const SIZE = { width: 900, height: 700 };
export const PATIENCE = 240000;
let outcrop, browser;
let count = 0;

export function check( what, fine, found = '' ) {

	if ( ! fine ) throw new Error( `${ what }: ${ typeof found === 'string' ? found : JSON.stringify( found ) }` );
	count ++;
	console.log( `  ${ what }${ found === '' ? '' : `: ${ typeof found === 'string' ? found : JSON.stringify( found ) }` }` );

}

/** The number of checks. */
export const passed = () => count;

/** Vertices of a binary PLY with doubles first, and the place of other properties of a byte. */
export function vertices( path ) {

	const bytes = readFileSync( path ), end = bytes.indexOf( 'end_header\n' ) + 11;
	const lines = bytes.subarray( 0, end ).toString( 'latin1' ).split( '\n' );
	const count = Number( lines.find( line => line.startsWith( 'element vertex' ) ).split( ' ' )[ 2 ] );
	const sizes = { double: 8, float: 4, uchar: 1, ushort: 2, int: 4 };
	const face = lines.findIndex( line => line.startsWith( 'element face' ) );
	const properties = lines.slice( 0, face ).filter( line => line.startsWith( 'property' ) ).map( line => line.split( ' ' ) );
	const stride = properties.reduce( ( sum, [ , type ] ) => sum + sizes[ type ], 0 );
	let at = 0;
	const places = {};
	for ( const [ , type, name ] of properties ) {

		places[ name ] = at;
		at += sizes[ type ];

	}

	return Array.from( { length: count }, ( _, n ) => {

		const from = end + n * stride;
		return { at: [ 0, 8, 16 ].map( k => bytes.readDoubleLE( from + k ) ), color: [ 'red', 'green', 'blue' ].map( name => bytes[ from + places[ name ] ] ) };

	} );

}

/** Programs that were started; a failed check leaves some running. */
const children = [];

/** A running `outcrop view`, and its URL. */
export async function serve( ...args ) {

	const child = spawn( outcrop, [ 'view', '--no-browser', '--quiet', ...args ], { stdio: [ 'ignore', 'pipe', 'inherit' ] } );
	children.push( child );
	const url = await new Promise( ( resolve, reject ) => {

		let text = '';
		child.stdout.on( 'data', part => ( text += part ).includes( '\n' ) && resolve( text.trim() ) );
		child.on( 'exit', code => reject( new Error( `outcrop view ended with ${ code }` ) ) );

	} );
	return { url, stop: signal => new Promise( resolve => { child.on( 'exit', ( code, by ) => resolve( code ?? by ) ); child.kill( signal ); } ) };

}

/** A page with all that it asked for, and all that went wrong. `prepare` gets the page before its first request. */
export async function open( url, { prepare = async () => {}, wait = true } = {} ) {

	const page = await browser.newPage( { viewport: SIZE } );
	const asked = [], errors = [];
	page.on( 'request', request => asked.push( request.url() ) );
	page.on( 'console', message => [ 'error', 'warning' ].includes( message.type() ) && ! /GPU stall|swiftshader/i.test( message.text() ) && errors.push( message.text() ) );
	page.on( 'pageerror', error => errors.push( String( error ) ) );
	await prepare( page );
	await page.goto( url );
	const settled = async () => {

		await page.waitForFunction( () => window.outcropViewer?.settled, null, { timeout: PATIENCE } );
		await page.waitForTimeout( 350 );
		await page.waitForFunction( () => window.outcropViewer.settled, null, { timeout: PATIENCE } );

	};
	if ( wait ) await settled();
	return { page, asked, errors, settled };

}

/** Starts the browser, for a program. */
export async function begin( program, chromium, modules ) {

	outcrop = program;
	const { chromium: driver } = createRequire( join( modules, 'x.js' ) )( 'playwright-core' );
	browser = await driver.launch( { executablePath: chromium, args: [
		'--headless', '--no-sandbox', '--enable-unsafe-swiftshader', '--use-angle=swiftshader', '--disable-quic', '--no-first-run',
		'--disable-background-networking', '--disable-component-update', '--disable-sync',
	] } );

}

/** Ends everything that was started. */
export function end() {

	for ( const child of children ) child.kill( 'SIGKILL' );
	return browser.close();

}

/** The picture of a page as numbers: red, green, blue and another one of each pixel. */
export const picture = page => page.evaluate( async () => {

	const image = new Image();
	image.src = window.outcropViewer.picture();
	await image.decode();
	const canvas = new OffscreenCanvas( image.width, image.height ), context = canvas.getContext( '2d' );
	context.drawImage( image, 0, 0 );
	return { width: image.width, height: image.height, data: Array.from( context.getImageData( 0, 0, image.width, image.height ).data ) };

} );
