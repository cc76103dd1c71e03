// Where tiles come from: the server of this page, or the page itself.

/** Text of base64 as bytes. */
function decode( text ) {

	const binary = atob( text );
	const bytes = new Uint8Array( binary.length );
	for ( let n = 0; n < binary.length; n ++ ) bytes[ n ] = binary.charCodeAt( n );
	return bytes;

}

/** The URL of the tileset at a path, and a plugin of the renderer that gets files. */
export function source( path ) {

	const embedded = document.getElementById( 'embedded-tileset' );
	const root = new URL( path, location.href.split( '#' )[ 0 ] );
	const url = new URL( 'tileset.json', root ).href;
	// The version is checked here; the renderer warns of each that is not 1.0.
	const read = json => {

		if ( ! /^1\.[01]$/.test( json?.asset?.version ) || ! json.root ) throw new Error( 'tileset.json is no tileset of 3D Tiles 1.0 or 1.1' );
		// A mesh that is placed on the globe is shown in the scan's own frame.
		const { transform, ...tile } = json.root;
		return { ...json, asset: { ...json.asset, version: '1.0' }, root: tile };

	};

	if ( ! embedded ) {

		return { url, embedded: false, plugin: {
			name: 'SERVER',
			async fetchData( address, options ) {

				const response = await fetch( address, options );
				return address === url && response.ok ? read( await response.json() ) : response;

			},
		} };

	}

	const tiles = new Map();
	for ( const element of document.querySelectorAll( 'script[data-uri]' ) ) {

		const uri = new TextDecoder().decode( decode( element.dataset.uri ) );
		tiles.set( new URL( uri, root ).href, element );

	}

	return { url, embedded: true, plugin: {
		name: 'EMBEDDED',
		async fetchData( address ) {

			if ( address === url ) return read( JSON.parse( embedded.textContent ) );
			const element = tiles.get( address );
			return element ? new Response( decode( element.textContent ) ) : new Response( null, { status: 404, statusText: 'not in this page' } );

		},
	} };

}
