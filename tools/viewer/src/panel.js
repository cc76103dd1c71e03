// Everything around the picture: buttons, settings, legend, counts, messages.

import { grouped, make, mib, plain, short } from './format.js';
import { icon } from './icons.js';
import { told } from './progress.js';
import { CLASSES, classColor, rampCss, SIGNED_COLUMN, signedCss } from './ramps.js';

const $ = id => document.getElementById( id );

const KEYS = [
	[ 'Moving', [
		[ 'Drag', 'turn around the point there' ], [ 'Right drag', 'shift; also Shift and drag' ], [ 'Wheel', 'zoom to the pointer' ],
		[ 'Double click', 'go there' ], [ 'G', 'fly with W A S D, Q, E, Shift' ], [ 'F', 'fit' ],
		[ '1  2  3', 'top, front, right' ], [ '4  5  6', 'left, back, bottom' ], [ '0', 'oblique' ], [ 'O', 'parallel projection' ],
	] ],
	[ 'Looking', [
		[ 'Click', 'coordinates of the nearest vertex' ], [ 'M', 'measure; Esc ends it' ], [ 'C', 'colour by the next property' ],
		[ 'E', 'eye-dome lighting' ], [ 'T', 'flat triangles' ], [ 'K', 'back faces in blue' ], [ 'X', 'edges of triangles' ],
		[ 'B', 'boundary edges' ], [ 'V', 'of two meshes: both sides, A, B, both' ], [ '[  ]', 'move the line between them' ], [ 'P', 'points of the cloud' ], [ 'L', 'copy a link to the view' ], [ 'N', 'light or dark' ], [ '?', 'this help' ],
	] ],
];

/** Text of the licences, if the page has it, or its address. */
function licences() {

	const text = $( 'licences' )?.textContent;
	if ( ! text ) return make( 'a', { href: 'THIRD-PARTY.txt', target: '_blank', textContent: 'Licences' } );
	return make( 'details', {}, make( 'summary', { textContent: 'Licences' } ), make( 'div', { id: 'licences-text', textContent: text } ) );

}

export class Panel {

	/** `actions` has a function for each button and setting. */
	constructor( actions ) {

		this.actions = actions;
		this.#tools();
		for ( const name of [ 'edl', 'flat', 'backs', 'wire', 'boundary' ] ) $( name ).addEventListener( 'change', event => actions.toggle( name, event.target.checked ) );
		$( 'color' ).addEventListener( 'change', event => actions.color( event.target.value ) );
		$( 'detail' ).addEventListener( 'change', event => actions.detail( Number( event.target.value ) ) );
		$( 'budget' ).addEventListener( 'change', event => actions.budget( Number( event.target.value ) ) );
		for ( const button of $( 'section-axis' ).children ) {

			button.setAttribute( 'role', 'radio' );
			button.addEventListener( 'click', () => actions.section( button.dataset.axis ) );

		}

		$( 'points-on' ).addEventListener( 'change', event => actions.points( { on: event.target.checked } ) );
		$( 'points-size' ).addEventListener( 'input', event => actions.points( { size: Number( event.target.value ) } ) );
		$( 'points-color' ).addEventListener( 'change', event => actions.points( { color: event.target.value } ) );
		$( 'section-at' ).addEventListener( 'input', event => actions.sectionAt( event.target.value / 1000 ) );
		$( 'section-flip' ).addEventListener( 'click', () => actions.sectionFlip() );
		$( 'help' ).append(
			make( 'h1', { textContent: 'Keys and pointer' } ),
			make( 'div', { className: 'columns' }, ...KEYS.map( ( [ title, rows ] ) => make( 'section', {}, make( 'h2', { textContent: title } ),
				make( 'table', {}, ...rows.map( ( [ key, does ] ) => make( 'tr', {}, make( 'td', {}, make( 'kbd', { textContent: key } ) ), make( 'td', { textContent: does } ) ) ) ) ) ) ),
			make( 'footer', {}, licences(), make( 'button', { className: 'small', textContent: 'Close', autofocus: true, onclick: () => $( 'help' ).close() } ) ),
		);

	}

	#tools() {

		const { actions } = this;
		const button = ( name, tip, act ) => {

			const made = make( 'button', { id: `tool-${ name }`, type: 'button', 'aria-label': tip, onclick: act }, icon( name ) );
			made.dataset.tip = tip;
			return made;

		};
		$( 'tools' ).append(
			button( 'fit', 'Fit (F)', () => actions.fit() ),
			button( 'top', 'From above (1)', () => actions.view( 'top' ) ),
			button( 'front', 'Front (2)', () => actions.view( 'front' ) ),
			button( 'right', 'Right (3)', () => actions.view( 'right' ) ),
			button( 'oblique', 'Oblique (0)', () => actions.view( 'oblique' ) ),
			make( 'hr' ),
			button( 'parallel', 'Parallel projection (O)', () => actions.parallel() ),
			button( 'fly', 'Fly (G)', () => actions.fly() ),
			button( 'measure', 'Measure (M)', () => actions.measure() ),
			make( 'hr' ),
			button( 'link', 'Copy a link to this view (L)', () => actions.link() ),
			button( 'theme', 'Light or dark (N)', () => actions.theme() ),
			button( 'help', 'Help (?)', () => this.help() ),
		);

	}

	help() { $( 'help' ).open ? $( 'help' ).close() : $( 'help' ).showModal(); }

	/** Meshes are known, and the properties by which they can be coloured. */
	opened( world, modes ) {

		const name = ( { name, info } ) => name || info.source.replace( /^.*[\\/]/, '' );
		const meshes = world.open, single = meshes.length === 1, { info } = world.first;
		const names = single ? info.source.replace( /^.*[\\/]/, '' ) : meshes.map( name ).join( ', ' );
		document.title = `${ names } – outcrop`;
		$( 'name' ).textContent = $( 'name' ).title = names;
		// The name of a reference system is the first text in quotes of WKT.
		const crs = info.crs && ( info.crs.match( /^\s*\w+\s*\[\s*"([^"]*)"/ )?.[ 1 ] ?? info.crs );
		const system = [ crs && crs.length <= 60 ? crs : null, info.epsg && ! String( crs ).includes( info.epsg ) ? `EPSG:${ info.epsg }` : null ];
		$( 'about' ).textContent = [ `${ meshes.map( mesh => short( mesh.info.triangles ) ).join( ' and ' ) } triangles`, ...system ].filter( Boolean ).join( ' · ' );
		$( 'about' ).title = meshes.map( ( { info } ) => `${ grouped( info.triangles ) } triangles, ${ grouped( info.vertices ?? 0 ) } vertices, ${ grouped( info.boundary_edges ?? 0 ) } boundary edges${ info.crs ? `\n${ info.crs }` : '' }` ).join( '\n' );
		$( 'color' ).replaceChildren( ...modes.map( ( [ value, text ] ) => make( 'option', { value, textContent: text } ) ) );

	}

	/** Points are there. */
	points( info ) {

		$( 'points' ).hidden = false;
		const all = info.points === info.of_points ? `All ${ short( info.points ) } points` : `${ short( info.points ) } of ${ short( info.of_points ) } points, one in each box of at most ${ plain( info.side, 4 ) }`;
		$( 'points-note' ).textContent = `${ info.name }: ${ all }`;
		$( 'points-note' ).title = `${ grouped( info.points ) } of ${ grouped( info.of_points ) } points`;
		$( 'points-by' ).hidden = ! info.colors;

	}

	/** How far a part is, as long as there is nothing to look at; null if it is loading. */
	loading( part ) {

		const { text, share } = part ? told( part ) : { text: 'Loading the mesh', share: null };
		$( 'loading' ).querySelector( 'p' ).textContent = text;
		$( 'loading' ).querySelector( 'b' ).hidden = share === null;
		$( 'loading' ).querySelector( 'i' ).style.width = `${ 100 * ( share ?? 0 ) }%`;

	}

	loaded() { $( 'loading' ).classList.add( 'done' ); }

	failed( text ) {

		$( 'loading' ).classList.remove( 'done' );
		$( 'loading' ).classList.add( 'failed' );
		$( 'loading' ).querySelector( 'p' ).textContent = text;

	}

	/** Shows the state of settings and buttons. */
	settings( { settings, navigator, section, mesh, measuring } ) {

		for ( const name of [ 'edl', 'flat', 'backs', 'wire', 'boundary' ] ) $( name ).checked = settings[ name ];
		$( 'color' ).value = settings.color;
		$( 'points-on' ).checked = mesh.cloud.on;
		$( 'points-size' ).value = mesh.cloud.size;
		$( 'points-color' ).value = mesh.cloud.color;
		$( 'detail' ).value = settings.detail;
		$( 'budget' ).value = settings.budget;
		const pressed = { parallel: navigator.orthographic, fly: navigator.flying, measure: measuring };
		for ( const [ name, on ] of Object.entries( pressed ) ) $( `tool-${ name }` ).setAttribute( 'aria-pressed', on );
		$( 'canvas' ).classList.toggle( 'picks', measuring );
		for ( const button of $( 'section-axis' ).children ) button.setAttribute( 'aria-checked', button.dataset.axis === section.axis );
		$( 'section-more' ).hidden = ! section.axis;
		if ( section.axis ) {

			const k = 'xyz'.indexOf( section.axis ), [ low, high ] = [ mesh.box.min[ section.axis ], mesh.box.max[ section.axis ] ];
			$( 'section-at' ).value = Math.round( 1000 * ( section.at - low ) / ( high - low ) );
			$( 'section-value' ).textContent = `${ section.axis } ${ section.side < 0 ? '≤' : '≥' } ${ ( section.at + mesh.info.origin[ k ] ).toFixed( Math.min( mesh.decimals, 3 ) ) }`;

		}

	}

	/** The meaning of the colours. */
	legend( mode, mesh ) {

		const name = mode.startsWith( 'column:' ) ? mode.slice( 7 ) : null;
		const range = mesh.range( mode );
		if ( name && mesh.isClass( name ) ) {

			$( 'legend' ).replaceChildren( make( 'ul', {}, ...mesh.classes( name ).map( n => {

				const swatch = make( 'i' );
				swatch.style.background = classColor( n );
				return make( 'li', {}, swatch, `${ n }  ${ CLASSES[ n ]?.[ 0 ] ?? 'Class' }` );

			} ) ) );
			return;

		}

		if ( ! range ) {

			$( 'legend' ).replaceChildren();
			return;

		}

		const add = mode === 'height' ? mesh.info.origin[ 2 ] : mesh.offset( mode );
		const digits = mode === 'height' ? Math.min( mesh.decimals, 3 ) : 3;
		const bar = make( 'div', { className: 'bar' } );
		bar.style.background = name === SIGNED_COLUMN ? signedCss : rampCss;
		const end = ( value, title ) => make( 'input', { type: 'text', inputMode: 'decimal', value: plain( value + add, digits ), title, 'aria-label': title, onchange: () => {

			const [ low, high ] = [ ...$( 'legend' ).querySelectorAll( 'input' ) ].map( input => input.value.trim() === '' ? NaN : Number( input.value ) - add );
			if ( Number.isFinite( low ) && Number.isFinite( high ) && low < high ) this.actions.range( low, high );
			else this.legend( mode, mesh );

		} } );
		$( 'legend' ).replaceChildren( bar, make( 'div', { className: 'ends' }, end( range.low, 'Lowest value' ), end( range.high, 'Highest value' ) ) );

	}

	/** Counts of what is drawn of the meshes in the picture. */
	stats( s, meshes, fps ) {

		const all = meshes.reduce( ( sum, mesh ) => sum + mesh.info.triangles, 0 );
		const rows = [
			[ 'Triangles', `${ short( s.triangles ) } of ${ short( all ) }` ],
			[ 'Tiles shown, held', `${ s.tiles }, ${ s.held }` ],
			[ 'Loading', s.loading || '–' ],
			[ 'Memory', mib( s.bytes ) ],
			[ 'Frame', fps ? `${ fps.toFixed( 0 ) } ms` : '–' ],
		];
		if ( s.missing ) rows.push( [ 'Missing tiles', s.missing ] );
		$( 'stats' ).replaceChildren( ...rows.flatMap( ( [ key, value ] ) => [ make( 'dt', { textContent: key } ), make( 'dd', { textContent: value } ) ] ) );
		const notes = [
			s.full ? 'The memory is full: the mesh is coarser than asked for.' : '',
			s.coarser > 1 ? 'Coarser than asked for, so that it stays fast.' : '',
		];
		$( 'note' ).textContent = notes.filter( Boolean ).join( ' ' );
		$( 'note' ).hidden = ! $( 'note' ).textContent;

	}

	/** A box with names and values below the picture; `text` goes to the clipboard. */
	result( title, rows, { text, note, close } ) {

		const box = $( 'result' );
		box.hidden = false;
		box.replaceChildren(
			make( 'h2', {}, title, make( 'button', { textContent: '×', title: 'Close', 'aria-label': 'Close', onclick: close } ) ),
			make( 'dl', {}, ...rows.flatMap( ( [ key, value ] ) => [ make( 'dt', { textContent: key } ), make( 'dd', { textContent: value } ) ] ) ),
			...( note ? [ make( 'p', { textContent: note } ) ] : [] ),
			...( text ? [ make( 'div', { className: 'row' }, make( 'button', { className: 'small', textContent: 'Copy', onclick: () => this.copy( text ) } ) ) ] : [] ),
		);

	}

	noResult() { $( 'result' ).hidden = true; }

	/** Text to the clipboard. */
	async copy( text ) {

		try {

			await navigator.clipboard.writeText( text );

		} catch {

			// Pages from a file may not use the clipboard otherwise.
			const area = make( 'textarea', { value: text } );
			document.body.append( area );
			area.select();
			document.execCommand( 'copy' );
			area.remove();

		}

		this.message( 'copied', 'Copied.', { fine: true } );

	}

	/** A message that stays until it is closed, or for a moment if it is fine. One of a kind at a time. */
	message( kind, text, { fine = false, action = null } = {} ) {

		$( `message-${ kind }` )?.remove();
		const box = make( 'div', { id: `message-${ kind }`, className: fine ? 'fine' : '' }, make( 'span', { textContent: text } ) );
		if ( action ) box.append( make( 'button', { textContent: action.text, onclick: () => { box.remove(); action.act(); } } ) );
		if ( ! fine ) box.append( make( 'button', { textContent: 'Close', onclick: () => box.remove() } ) );
		else setTimeout( () => box.remove(), 1600 );
		$( 'messages' ).append( box );

	}

	/** The scan's coordinates under the pointer. */
	cursor( text ) { $( 'cursor' ).textContent = text; }

	/** The scale: so many pixels are a length. */
	scale( pixels, length ) {

		const [ bar, text ] = $( 'scale' ).children;
		bar.style.width = `${ pixels }px`;
		text.textContent = plain( length, 9 );

	}

}
