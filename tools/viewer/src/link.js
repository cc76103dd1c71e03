// A view as text in the URL. Coordinates are those of the scan, so that a link fits any copy of the mesh.

import { Vector3 } from 'three';

/** The view as text. */
export function write( { navigator, mesh, section, settings, split } ) {

	const { focus, distance, yaw, pitch, orthographic } = navigator.state();
	const digits = Math.max( 0, Math.min( 9, 4 - Math.floor( Math.log10( distance ) ) ) );
	const degrees = x => Number( ( x * 180 / Math.PI ).toFixed( 3 ) );
	const parts = {
		at: mesh.toScan( focus ).map( x => x.toFixed( digits ) ).join(),
		far: Number( distance.toPrecision( 6 ) ),
		look: [ degrees( yaw ), degrees( pitch ) ].join(),
		...( orthographic ? { parallel: 1 } : {} ),
		...( settings.color === 'plain' ? {} : { color: settings.color } ),
		...( split.two ? { show: split.mode === 'split' ? `split,${ Number( split.at.toFixed( 3 ) ) }` : split.mode } : {} ),
		...( mesh.cloud.info ? { points: mesh.cloud.on ? [ mesh.cloud.size, mesh.cloud.color ].join() : 'off' } : {} ),
		...( section.axis ? { cut: [ section.axis, ( section.at + mesh.info.origin[ 'xyz'.indexOf( section.axis ) ] ).toFixed( digits ), section.side ].join() } : {} ),
	};
	return '#' + Object.entries( parts ).map( ( [ key, value ] ) => `${ key }=${ encodeURIComponent( value ).replaceAll( '%2C', ',' ).replaceAll( '%3A', ':' ) }` ).join( '&' );

}

/** What a text tells of the line between two meshes, and of points. Whatever is not valid is left out. */
export function readShown( hash ) {

	const parts = new URLSearchParams( hash.replace( /^#/, '' ) );
	const [ mode, at ] = ( parts.get( 'show' ) ?? '' ).split( ',' ), [ size, color ] = ( parts.get( 'points' ) ?? '' ).split( ',' );
	const part = at === undefined || at.trim() === '' ? NaN : Number( at );
	return {
		mode, at: part >= 0 && part <= 1 ? part : null,
		points: {
			...( size === 'off' ? { on: false } : {} ),
			...( Number( size ) >= 1 && Number( size ) <= 12 ? { size: Number( size ) } : {} ),
			...( [ 'color', 'plain' ].includes( color ) ? { color } : {} ),
		},
	};

}

/** The view that a text tells, or null. Whatever is not valid is left out. */
export function read( hash, mesh ) {

	const parts = new URLSearchParams( hash.replace( /^#/, '' ) );
	const numbers = ( name, count ) => {

		const list = ( parts.get( name ) ?? '' ).split( ',' ).map( x => x.trim() === '' ? NaN : Number( x ) );
		return list.length === count && list.every( Number.isFinite ) ? list : null;

	};
	const [ at, far, look ] = [ numbers( 'at', 3 ), numbers( 'far', 1 ), numbers( 'look', 2 ) ];
	if ( ! at || ! look || ! ( far?.[ 0 ] > 0 ) ) return null;
	const local = mesh.toLocal( at );
	const [ axis, cut, side ] = ( parts.get( 'cut' ) ?? '' ).split( ',' );
	const section = 'xyz'.includes( axis ) && axis.length === 1 && Number.isFinite( Number( cut ) )
		? { axis, at: Number( cut ) - mesh.info.origin[ 'xyz'.indexOf( axis ) ], side: Number( side ) < 0 ? - 1 : 1 } : null;
	return {
		camera: {
			focus: new Vector3().copy( local ), distance: far[ 0 ], yaw: look[ 0 ] * Math.PI / 180, pitch: look[ 1 ] * Math.PI / 180,
			orthographic: parts.get( 'parallel' ) === '1',
		},
		color: parts.get( 'color' ),
		section,
	};

}
