// Numbers for people.

const GROUPED = new Intl.NumberFormat( 'en', { useGrouping: true } );

/** 1 234 567 */
export const grouped = n => GROUPED.format( Math.round( n ) ).replaceAll( ',', '\u2009' );

/** 21.3 M */
export function short( n ) {

	if ( n >= 1e9 ) return `${ ( n / 1e9 ).toFixed( 2 ) }\u2009G`;
	if ( n >= 1e6 ) return `${ ( n / 1e6 ).toFixed( n < 1e7 ? 2 : 1 ) }\u2009M`;
	return n >= 1e4 ? `${ ( n / 1e3 ).toFixed( 0 ) }\u2009k` : grouped( n );

}

export const mib = bytes => bytes >= 2 ** 30 ? `${ ( bytes / 2 ** 30 ).toFixed( 2 ) }\u2009GiB` : `${ ( bytes / 2 ** 20 ).toFixed( 0 ) }\u2009MiB`;

/** A number with at most so many decimals, without zeros at the end. */
export const plain = ( x, decimals ) => String( Number( x.toFixed( Math.min( decimals, 15 ) ) ) );

/** Number of decimals of a lattice step. */
export function decimals( step ) {

	for ( let n = 0; n < 12; n ++ ) if ( Math.abs( step * 10 ** n - Math.round( step * 10 ** n ) ) < 1e-9 * 10 ** n * step ) return n;
	return 12;

}

/** An element with its content. */
export function make( name, properties = {}, ...children ) {

	const made = document.createElement( name );
	for ( const [ key, value ] of Object.entries( properties ) ) {

		if ( key in made ) made[ key ] = value;
		else made.setAttribute( key, value );

	}

	made.append( ...children );
	return made;

}
