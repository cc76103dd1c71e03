// Two meshes in one picture: each on its side of a line that can be moved, one of them alone, or both together.

import { Vector2 } from 'three';

const $ = id => document.getElementById( id );

/** What is shown, in the order of the key. */
export const SHOWN = [ 'split', 'a', 'b', 'both' ];

/** A press of a key moves the line by this part of the picture. */
const STEP = 0.02;

export class Split {

	/** `changed` is called when another picture is to be drawn. */
	constructor( changed ) {

		Object.assign( this, { changed, mode: 'split', at: 0.5, two: false } );
		for ( const button of $( 'compare' ).children ) {

			button.setAttribute( 'role', 'radio' );
			button.addEventListener( 'click', () => this.set( button.dataset.show ) );

		}

		const handle = $( 'handle' );
		handle.addEventListener( 'pointerdown', event => {

			event.preventDefault();
			handle.focus( { preventScroll: true } );
			handle.setPointerCapture( event.pointerId );

		} );
		handle.addEventListener( 'pointermove', event => handle.hasPointerCapture( event.pointerId ) && this.move( event.clientX / innerWidth ) );
		handle.addEventListener( 'keydown', event => {

			const to = { ArrowLeft: this.at - STEP, ArrowRight: this.at + STEP, Home: 0, End: 1 }[ event.key ];
			if ( to === undefined ) return;
			event.preventDefault();
			event.stopPropagation();
			this.move( to );

		} );

	}

	/** Two meshes with these names are there, or will be. */
	name( [ a, b ] ) {

		this.two = true;
		document.body.classList.add( 'two' );
		$( 'name-a' ).textContent = a;
		$( 'name-b' ).textContent = b;
		for ( const button of $( 'compare' ).children ) {

			const what = { a: `A: ${ a }`, b: `B: ${ b }`, split: 'A on the left, B on the right of a line', both: 'Both together' }[ button.dataset.show ];
			button.title = `${ what } (V)`;

		}

		this.show();

	}

	/** Shows `split`, `a`, `b` or `both`. */
	set( mode ) {

		if ( ! SHOWN.includes( mode ) ) return;
		this.mode = mode;
		this.show();

	}

	/** Shows the next of them. */
	next() { if ( this.two ) this.set( SHOWN[ ( SHOWN.indexOf( this.mode ) + 1 ) % SHOWN.length ] ); }

	/** Moves the line to a part of the width. */
	move( to ) {

		this.at = Math.min( Math.max( to, 0 ), 1 );
		this.show();

	}

	/** Moves it by some steps. */
	nudge( steps ) { if ( this.two && this.mode === 'split' ) this.move( this.at + steps * STEP ); }

	/** The state of buttons, line and names. */
	show() {

		if ( ! this.two ) return;
		const split = this.mode === 'split';
		for ( const button of $( 'compare' ).children ) button.setAttribute( 'aria-checked', button.dataset.show === this.mode );
		$( 'compare' ).hidden = false;
		$( 'handle' ).hidden = ! split;
		const percent = Math.round( 100 * this.at );
		$( 'handle' ).style.left = `${ 100 * this.at }%`;
		$( 'handle' ).setAttribute( 'aria-valuenow', percent );
		$( 'handle' ).setAttribute( 'aria-valuetext', `A has ${ percent } % of the width` );
		$( 'sides' ).className = this.mode;
		$( 'sides' ).hidden = false;
		$( 'sides' ).style.setProperty( '--at', `${ 100 * this.at }%` );
		this.changed();

	}

	/** Parts of the width from left to right, each with its meshes. */
	passes( meshes ) {

		const [ a, b ] = meshes, whole = shown => [ { meshes: shown, from: 0, to: 1 } ];
		if ( ! b || this.mode === 'both' ) return whole( meshes );
		if ( this.mode === 'a' ) return whole( [ a ] );
		if ( this.mode === 'b' ) return whole( [ b ] );
		return [ { meshes: [ a ], from: 0, to: this.at }, { meshes: [ b ], from: this.at, to: 1 } ];

	}

	/** The meshes at a part of the width. */
	under( meshes, part ) { return this.passes( meshes ).find( pass => part < pass.to || pass.to === 1 ).meshes; }

	/** All meshes that are in the picture. */
	shown( meshes ) { return this.passes( meshes ).flatMap( pass => pass.meshes ); }

	/** Draws a scene with each mesh on its side, into a target or on the screen. */
	paint( renderer, target, scene, camera, meshes ) {

		const size = renderer.getDrawingBufferSize( new Vector2() ), ratio = renderer.getPixelRatio();
		const passes = this.passes( meshes ), several = passes.length > 1;
		for ( const { meshes: shown, from, to } of passes ) {

			const [ left, right ] = [ from, to ].map( part => Math.round( part * size.x ) );
			if ( several && left === right ) continue;
			if ( target ) {

				target.scissorTest = several;
				target.scissor.set( left, 0, right - left, size.y );

			} else {

				renderer.setScissorTest( several );
				renderer.setScissor( left / ratio, 0, ( right - left ) / ratio, size.y / ratio );

			}

			for ( const mesh of meshes ) mesh.tiles.group.visible = shown.includes( mesh );
			renderer.setRenderTarget( target );
			renderer.render( scene, camera );

		}

		renderer.setScissorTest( false );
		for ( const mesh of meshes ) mesh.tiles.group.visible = true;

	}

}
