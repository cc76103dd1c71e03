// Colours for numbers: a ramp, and the classes of LAS.

import { ClampToEdgeWrapping, DataTexture, LinearFilter, NearestFilter, RGBAFormat } from 'three';

// Viridis at nine places.
const VIRIDIS = [ '440154', '482878', '3e4989', '31688e', '26828e', '1f9e89', '35b779', '6ece58', 'b5de2b', 'fde725' ];

/** Names and colours of the classes of LAS 1.4. */
export const CLASSES = {
	0: [ 'Never classified', '#9aa0a6' ], 1: [ 'Unclassified', '#b4b8bc' ], 2: [ 'Ground', '#b08a5b' ],
	3: [ 'Low vegetation', '#b7d77a' ], 4: [ 'Medium vegetation', '#7dbb57' ], 5: [ 'High vegetation', '#3d8f45' ],
	6: [ 'Building', '#d9694f' ], 7: [ 'Low noise', '#d14fa8' ], 8: [ 'Key point', '#e0c341' ], 9: [ 'Water', '#4a9bdc' ],
	10: [ 'Rail', '#6a5c8f' ], 11: [ 'Road surface', '#6f767d' ], 12: [ 'Overlap', '#c9b6d8' ], 13: [ 'Wire, guard', '#e39a3b' ],
	14: [ 'Wire, conductor', '#e3b23b' ], 15: [ 'Tower', '#8f4a3a' ], 16: [ 'Wire connector', '#c78a2e' ],
	17: [ 'Bridge deck', '#8a6fae' ], 18: [ 'High noise', '#b03f8d' ],
};

const bytes = hex => [ 0, 2, 4 ].map( at => parseInt( hex.slice( at, at + 2 ), 16 ) );

/** The ramp's colour at a place between 0 and 1, as three bytes. */
export function viridis( t ) {

	const at = Math.min( Math.max( t, 0 ), 1 ) * ( VIRIDIS.length - 1 );
	const low = Math.min( Math.floor( at ), VIRIDIS.length - 2 );
	const [ a, b ] = [ bytes( VIRIDIS[ low ] ), bytes( VIRIDIS[ low + 1 ] ) ];
	return a.map( ( x, k ) => Math.round( x + ( b[ k ] - x ) * ( at - low ) ) );

}

/** Colour of a number of a tile or level, as three numbers up to 1: neighbours differ. */
export function distinct( number ) {

	const hue = ( number * 0.61803398875 ) % 1, light = 0.55 + 0.13 * ( number % 3 );
	return [ 0, 8, 4 ].map( k => {

		const x = ( k + hue * 12 ) % 12;
		return light - 0.42 * Math.min( light, 1 - light ) * Math.max( - 1, Math.min( x - 3, 9 - x, 1 ) );

	} );

}

/** Colour of a class. */
export const classColor = number => CLASSES[ number ]?.[ 1 ] ?? `rgb(${ distinct( number ).map( x => Math.round( 255 * x ) ) })`;

function row( color, filter ) {

	const data = new Uint8Array( 256 * 4 ).fill( 255 );
	for ( let n = 0; n < 256; n ++ ) data.set( color( n ), 4 * n );
	const texture = new DataTexture( data, 256, 1, RGBAFormat );
	texture.minFilter = texture.magFilter = filter;
	texture.wrapS = texture.wrapT = ClampToEdgeWrapping;
	texture.needsUpdate = true;
	return texture;

}

export const rampTexture = () => row( n => viridis( n / 255 ), LinearFilter );

export const classTexture = () => row( n => CLASSES[ n ]
	? bytes( CLASSES[ n ][ 1 ].slice( 1 ) )
	: distinct( n ).map( x => Math.round( 255 * x ) ), NearestFilter );

/** The column whose values have a sign: what `outcrop change` writes. */
export const SIGNED_COLUMN = 'change';

/** Colours for loss, no change and growth. */
export const SIGNED = [ '2166ac', 'f0f0f0', 'b2182b' ];

/** These as a background of CSS. */
export const signedCss = `linear-gradient(to right, ${ SIGNED.map( hex => '#' + hex ).join( ', ' ) })`;

/** The ramp as a background of CSS. */
export const rampCss = `linear-gradient(to right, ${ VIRIDIS.map( hex => '#' + hex ).join( ', ' ) })`;
