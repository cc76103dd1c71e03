// What is shown: one mesh or two, and points. The server tells what of it is there; the page in one file has it all.

/** Time between two questions while parts are coming, in ms. */
const WAIT = 500;

/** The one part of the page in one file. */
const EMBEDDED = { parts: [ { kind: 'mesh', path: 'mesh/', name: '', state: 'ready', matrix: null } ], failed: null };

async function ask() {

	if ( document.getElementById( 'embedded-tileset' ) ) return EMBEDDED;
	const response = await fetch( 'scene.json' );
	if ( ! response.ok ) throw new Error( response.statusText );
	return response.json();

}

/**
 * Asks until all parts are there. `known` gets all parts once, `ready` each one when it is there, `coming` those that
 * are not there yet, each time, and `failed` a text if there will be no more.
 */
export function watch( { known, ready, coming, failed } ) {

	const shown = new Set();
	let first = true;
	const look = async () => {

		let state;
		try {

			state = await ask();

		} catch {

			failed( 'The program has ended: it has the reason on its screen.' );
			return;

		}

		if ( first ) known( state.parts );
		first = false;
		for ( const part of state.parts.filter( part => part.state === 'ready' && ! shown.has( part.path ) ) ) {

			shown.add( part.path );
			ready( part );

		}

		const others = state.parts.filter( part => part.state !== 'ready' );
		coming( others );
		if ( state.failed ) failed( state.failed );
		else if ( others.length ) setTimeout( look, WAIT );

	};
	look();

}
