// What is still on its way, in a line that is not in the way.

import { grouped, make, short } from './format.js';

/** Loading of tiles is told when it takes longer than this, in ms. */
const PATIENCE = 400;

/** 12 s, 3 min */
const time = seconds => seconds < 90 ? `${ Math.max( 1, Math.round( seconds ) ) } s` : seconds < 5400 ? `${ Math.round( seconds / 60 ) } min` : `${ ( seconds / 3600 ).toFixed( 1 ) } h`;

/** The work on a part in words, and the share of it that is done, if it is known. */
export function told( part ) {

	const what = part.kind === 'points' ? `Reading the points of ${ part.name }` : `Making levels of detail of ${ part.name }`;
	if ( part.state === 'waiting' || ! part.work?.stage ) return { text: part.state === 'waiting' ? `${ part.name } comes next` : what, share: null };
	const { stage, unit, done, total, share, left } = part.work, percent = x => `${ Math.floor( 100 * Math.min( x, 1 ) ) }\u2009%`;
	// Of the whole work, if its plan is known; else of the stage, or what was counted.
	const known = share ?? ( total ? done / total : null );
	const much = known !== null ? `${ percent( known ) } (${ stage })` : [ stage, done ? `${ short( done ) } ${ unit }` : '' ].filter( Boolean ).join( ', ' );
	return { text: `${ what }: ${ much }${ left ? `, about ${ time( left ) } left` : '' }`, share: known };

}

export class Progress {

	constructor() {

		this.box = document.getElementById( 'progress' );
		this.since = null;
		this.most = 0;
		this.before = '';

	}

	/** Shows parts that are made, `tiles` that are loading, and bytes of points that are. */
	show( coming, tiles, points, now ) {

		if ( ! tiles ) [ this.since, this.most ] = [ null, 0 ];
		else this.since ??= now;
		this.most = Math.max( this.most, tiles );
		const lines = coming.map( told );
		if ( points ) lines.push( { text: 'Loading the points', share: points.total ? points.done / points.total : null } );
		if ( tiles && now - this.since > PATIENCE ) lines.push( { text: `Loading ${ grouped( tiles ) } tile${ tiles > 1 ? 's' : '' }`, share: 1 - tiles / this.most } );
		const after = JSON.stringify( lines );
		if ( after === this.before ) return;
		this.before = after;
		this.box.hidden = lines.length === 0;
		this.box.replaceChildren( ...lines.map( ( { text, share } ) => {

			const bar = make( 'i' );
			bar.style.width = `${ 100 * ( share ?? 0 ) }%`;
			return make( 'div', {}, make( 'span', { textContent: text } ), make( 'b', { hidden: share === null }, bar ) );

		} ) );

	}

}
